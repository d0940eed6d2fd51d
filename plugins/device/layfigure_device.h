/*
 * The interface between layfigure-server and a plugin that drives a haptic device, in C.
 *
 * A plugin is a shared object that exports one function, layfigure_device_plugin(), which returns a table of functions.
 * The server is told to use it by --device PATH/plugin.so, with the path of a file of the plugin's own, if any, by
 * --device-config FILE. Try a plugin with layfigure-device-check PATH/plugin.so before a hand is put to it.
 *
 * Frames and units. The device's frame D is right-handed: x to the right, y away from the user, z up; its origin is
 * where the grip rests. Metres, newtons, newton metres, seconds, radians. Quaternions are unit, w x y z; the identity
 * is how the grip rests.
 *
 * Threads. Every function is called from one thread at a time. read() and write() are called one after the other at
 * each haptic tick, at 1 kHz to 10 kHz: they must not wait, not for the device either, and should neither allocate nor
 * print. A plugin whose device is slow talks to it on a thread of its own and hands over the newest value.
 *
 * Safety. The server limits forces and their rates, and asks for no force within 10 ms of anything that goes wrong.
 * What it cannot do is answer for itself when it is killed: a plugin of a device that can hurt sees to it that the
 * device lets go when write() is not called for 10 ms.
 */
#ifndef LAYFIGURE_DEVICE_H
#define LAYFIGURE_DEVICE_H

#include <stddef.h>
#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

/* Of this file. A server refuses a plugin of another version. */
#define LAYFIGURE_DEVICE_VERSION 1u

/* An open device: the plugin's own. */
typedef struct layfigure_device layfigure_device;

/* What the device is like; does not change while it is open. */
typedef struct {
  char name[64];      /* UTF-8, ends with a zero byte, not empty */
  double max_force;   /* that it can exert in every direction [N], 0 if it cannot push */
  double max_torque;  /* [N m], 0 if it cannot turn */
  double reach;       /* how far its grip gets from the origin [m], above 0 */
  double reach_angle; /* how far it turns from rest [rad], 0 or more */
} layfigure_device_info;

/* Where the grip is, in D. */
typedef struct {
  double position[3]; /* [m] */
  double rotation[4]; /* unit quaternion, grip to D, w x y z */
  double grip;        /* 0 open .. 1 squeezed; 0 if it has none */
  uint32_t buttons;   /* bit k: button k is down */
} layfigure_device_state;

/* Results of read(). */
enum {
  LAYFIGURE_DEVICE_OK = 0,          /* `state` is filled in, and newer than that of the last call */
  LAYFIGURE_DEVICE_NOTHING_NEW = 1, /* since the last call */
  LAYFIGURE_DEVICE_INVALID = 2,     /* the device tells something that cannot be */
  LAYFIGURE_DEVICE_GONE = 3         /* it is not there any more */
};

/* None may be NULL. */
typedef struct {
  uint32_t version; /* LAYFIGURE_DEVICE_VERSION */

  /*
   * Opens the device. `config` is a file's path, or "". On failure returns NULL and puts one line, without a newline,
   * that names what is wrong and its mend into `error`, of `error_size` bytes with the zero byte. May be called again
   * while another device is open, for a second one; a plugin that has but one then fails.
   */
  layfigure_device* (*open)(const char* config, char* error, size_t error_size);

  void (*info)(const layfigure_device* device, layfigure_device_info* info);

  /*
   * The newest pose. `time` [s] runs evenly and never back, from any start: with the wall clock, or, when the server
   * runs in lockstep, with the simulation. What a plugin integrates, it integrates over it.
   */
  int (*read)(layfigure_device* device, double time, layfigure_device_state* state);

  /*
   * Exerts a force and a torque about the grip's origin on the hand, in D, until the next call. Values beyond what the
   * device can do are cut; of values that are not finite nothing is exerted.
   */
  void (*write)(layfigure_device* device, const double force[3], const double torque[3]);

  /* What the device exerts, or was last told to after cutting; for tests and reports. */
  void (*exerted)(const layfigure_device* device, double force[3], double torque[3]);

  /* Lets go and closes. */
  void (*close)(layfigure_device* device);
} layfigure_device_functions;

#if defined(_WIN32)
#define LAYFIGURE_DEVICE_EXPORT __declspec(dllexport)
#else
#define LAYFIGURE_DEVICE_EXPORT __attribute__((visibility("default")))
#endif

/* What a plugin exports: valid as long as it is loaded. */
LAYFIGURE_DEVICE_EXPORT const layfigure_device_functions* layfigure_device_plugin(void);

#ifdef __cplusplus
}
#endif

#endif /* LAYFIGURE_DEVICE_H */
