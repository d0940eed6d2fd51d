/* Plugins for the tests: a good one, and, with DEFECT set to one of those below, one for each way to be unfit. */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

#include "layfigure_device.h"

enum {
  good,
  wrong_version,
  no_symbol,
  no_table,
  no_read,
  no_close,
  does_not_open,
  bad_info,
  no_name,
  nan_pose,
  not_unit,
  jumps,
  far,
  slow,
  never,
  blocks,
  takes_nan,
  unlimited,
  holds_on,
  weak,
  opens_once,
  goes
};

#define MAX_FORCE 4.0
#define MAX_TORQUE 0.1

struct layfigure_device {
  double force[3], torque[3];
  long reads;
};

/* Outlives the plugin, which is unloaded in between. */
#define OPENED "LAYFIGURE_TEST_PLUGIN_OPENED"

static layfigure_device* open_device(const char* config, char* error, size_t error_size) {
  (void)config;
  if (DEFECT == does_not_open || (DEFECT == opens_once && getenv(OPENED) != NULL)) {
    unsetenv(OPENED);
    snprintf(error, error_size, "the cable is not plugged in: plug it in");
    return NULL;
  }
  if (DEFECT == opens_once) setenv(OPENED, "1", 1);
  return calloc(1, sizeof(layfigure_device));
}

static void get_info(const layfigure_device* device, layfigure_device_info* info) {
  (void)device;
  memset(info, 0, sizeof *info);
  if (DEFECT != no_name) snprintf(info->name, sizeof info->name, "test plugin");
  info->max_force = DEFECT == bad_info ? NAN : MAX_FORCE;
  info->max_torque = MAX_TORQUE;
  info->reach = 0.1;
  info->reach_angle = 1.0;
}

static int read_device(layfigure_device* device, double time, layfigure_device_state* state) {
  const struct timespec nap = {0, 2000000};
  const double phase = 6.0 * time;
  ++device->reads;
  if (DEFECT == never) return LAYFIGURE_DEVICE_NOTHING_NEW;
  if (DEFECT == slow && device->reads % 20 != 1) return LAYFIGURE_DEVICE_NOTHING_NEW;
  if (DEFECT == goes && device->reads > 50) return LAYFIGURE_DEVICE_GONE;
  if (DEFECT == blocks) nanosleep(&nap, NULL);
  state->position[0] = 0.02 * sin(phase);
  state->position[1] = 0.0;
  state->position[2] = 0.02 * cos(phase);
  state->rotation[0] = cos(0.1 * sin(phase));
  state->rotation[1] = sin(0.1 * sin(phase));
  state->rotation[2] = state->rotation[3] = 0.0;
  state->grip = 0.5;
  state->buttons = 6;
  if (DEFECT == nan_pose && device->reads == 20) state->position[1] = NAN;
  if (DEFECT == not_unit) state->rotation[0] += 0.01;
  if (DEFECT == jumps && device->reads % 30 == 0) state->position[1] = 0.1;
  if (DEFECT == far) state->position[2] += 10.0;
  return LAYFIGURE_DEVICE_OK;
}

static void cut(const double from[3], double most, double to[3]) {
  const double size = sqrt(from[0] * from[0] + from[1] * from[1] + from[2] * from[2]);
  int k;
  for (k = 0; k < 3; ++k) {
    to[k] = from[k];
    if (DEFECT == weak) to[k] *= 0.2;
    if (DEFECT == unlimited) continue;
    if (isfinite(from[k]) && isinf(size)) {
      to[k] = from[k] == 0.0 ? 0.0 : copysign(0.5 * most, from[k]);
    } else if (size > most) {
      to[k] *= most / size;
    }
  }
}

static void write_device(layfigure_device* device, const double force[3], const double torque[3]) {
  double finite = 0.0;
  int k;
  for (k = 0; k < 3; ++k) finite += 0.0 * force[k] + 0.0 * torque[k];
  if (finite != 0.0 && DEFECT != takes_nan) {
    memset(device->force, 0, sizeof device->force);
    memset(device->torque, 0, sizeof device->torque);
    return;
  }
  if (DEFECT == holds_on && force[0] == 0.0 && force[1] == 0.0 && force[2] == 0.0) return;
  cut(force, MAX_FORCE, device->force);
  cut(torque, MAX_TORQUE, device->torque);
}

static void get_exerted(const layfigure_device* device, double force[3], double torque[3]) {
  memcpy(force, device->force, sizeof device->force);
  memcpy(torque, device->torque, sizeof device->torque);
}

static void close_device(layfigure_device* device) { free(device); }

#if DEFECT_IS_NO_SYMBOL
LAYFIGURE_DEVICE_EXPORT const void* some_other_function(void);
const void* some_other_function(void) {
#else
const layfigure_device_functions* layfigure_device_plugin(void) {
#endif
  static const layfigure_device_functions functions = {
      DEFECT == wrong_version ? 99u : LAYFIGURE_DEVICE_VERSION,
      open_device,
      get_info,
      DEFECT == no_read ? NULL : read_device,
      write_device,
      get_exerted,
      DEFECT == no_close ? NULL : close_device,
  };
  return DEFECT == no_table ? NULL : &functions;
}
