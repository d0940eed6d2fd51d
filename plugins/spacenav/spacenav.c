/*
 * 3Dconnexion devices (SpaceMouse, SpaceNavigator, ..) through libspnav and the daemon spacenavd.
 *
 * Such a device does not tell where it is but how far its cap is pushed and turned. The plugin takes that as a
 * velocity: p <- p + dt speed m / FULL_SCALE,   R <- exp(dt turn_speed r / FULL_SCALE) R with m and r what spacenavd
 * tells, in counts, and keeps p within `reach` of the origin. The cap let go, the pose stays. Button 0 squeezes the
 * grip. There is no force.
 *
 * spacenavd's axes are x right, y up, z away from the user, turns about the same: y and z change places in D.
 *
 * The config file, if any, has lines `key = value`, all optional, # starts a comment:
 *     speed = 0.2         # at full deflection [m/s]
 *     turn_speed = 1.0    # at full deflection [rad/s]
 *     reach = 0.5         # [m]
 *
 * The daemon's socket is /var/run/spnav.sock, or $SPNAV_SOCKET.
 */
#include <errno.h>
#include <math.h>
#include <spnav.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/socket.h>

#include "layfigure_device.h"

/* Counts of a cap that is pushed or turned all the way, at the daemon's own sensitivity. */
#define FULL_SCALE 350.0
/* A longer time between two reads is a pause, in which nothing moves. */
#define LONGEST_STEP 0.1 /* [s] */
/* After so many events one read is done: the daemon sends some hundred a second. */
#define MOST_EVENTS 1000

struct layfigure_device {
  double speed, turn_speed, reach;
  double time;
  int has_time;
  double velocity[3]; /* in D, in parts of full deflection */
  double spin[3];
  double position[3];
  double rotation[4];
  uint32_t buttons;
};

/* libspnav has one connection in a process. */
static int is_open = 0;

static void say(char* error, size_t size, const char* text, const char* what) { snprintf(error, size, text, what); }

static int is_positive(double x) { return isfinite(x) && x > 0.0; }

/* One line of the config file; returns 0 if it is no good. */
static int read_line(layfigure_device* device, char* line) {
  char key[32], end;
  double value;
  line[strcspn(line, "#\n")] = '\0';
  if (strspn(line, " \t\r") == strlen(line)) return 1;
  if (sscanf(line, " %31[a-z_] = %lf %c", key, &value, &end) != 2 || !is_positive(value)) return 0;
  if (strcmp(key, "speed") == 0) {
    device->speed = value;
  } else if (strcmp(key, "turn_speed") == 0) {
    device->turn_speed = value;
  } else if (strcmp(key, "reach") == 0) {
    device->reach = value;
  } else {
    return 0;
  }
  return 1;
}

static int read_config(layfigure_device* device, const char* path, char* error, size_t error_size) {
  char line[256];
  int number = 0;
  FILE* file;
  if (path[0] == '\0') return 1;
  file = fopen(path, "r");
  if (file == NULL) {
    snprintf(error, error_size, "%s: %s", path, strerror(errno));
    return 0;
  }
  while (fgets(line, sizeof line, file) != NULL) {
    ++number;
    if (read_line(device, line)) continue;
    snprintf(error, error_size, "%s:%d: expected speed, turn_speed or reach = a number above 0", path, number);
    fclose(file);
    return 0;
  }
  fclose(file);
  return 1;
}

static layfigure_device* open_device(const char* config, char* error, size_t error_size) {
  layfigure_device* device;
  if (is_open) {
    say(error, error_size, "%s", "the spacenav plugin has one device in a process, and it is open already");
    return NULL;
  }
  device = calloc(1, sizeof *device);
  if (device == NULL) {
    say(error, error_size, "%s", "out of memory");
    return NULL;
  }
  device->speed = 0.2;
  device->turn_speed = 1.0;
  device->reach = 0.5;
  device->rotation[0] = 1.0;
  if (!read_config(device, config, error, error_size)) {
    free(device);
    return NULL;
  }
  if (spnav_open() == -1) {
    say(error, error_size, "%s",
        "no spacenavd answers at /var/run/spnav.sock or $SPNAV_SOCKET: install and start spacenavd");
    free(device);
    return NULL;
  }
  is_open = 1;
  return device;
}

static void get_info(const layfigure_device* device, layfigure_device_info* info) {
  memset(info, 0, sizeof *info);
  snprintf(info->name, sizeof info->name, "3Dconnexion (spacenavd)");
  info->reach = device->reach;
  info->reach_angle = 3.14159265358979323846;
}

static void take_motion(layfigure_device* device, const struct spnav_event_motion* motion) {
  device->velocity[0] = motion->x / FULL_SCALE;
  device->velocity[1] = motion->z / FULL_SCALE;
  device->velocity[2] = motion->y / FULL_SCALE;
  device->spin[0] = motion->rx / FULL_SCALE;
  device->spin[1] = motion->rz / FULL_SCALE;
  device->spin[2] = motion->ry / FULL_SCALE;
}

static void take_button(layfigure_device* device, const struct spnav_event_button* button) {
  uint32_t bit;
  if (button->bnum < 0 || button->bnum > 31) return;
  bit = (uint32_t)1 << button->bnum;
  device->buttons = button->press ? device->buttons | bit : device->buttons & ~bit;
}

static void take_events(layfigure_device* device) {
  spnav_event event;
  int k;
  for (k = 0; k < MOST_EVENTS && spnav_poll_event(&event) != 0; ++k) {
    if (event.type == SPNAV_EVENT_MOTION) take_motion(device, &event.motion);
    if (event.type == SPNAV_EVENT_BUTTON) take_button(device, &event.button);
  }
}

/* libspnav does not say that the daemon has gone. */
static int is_gone(void) {
  char byte;
  const ssize_t got = recv(spnav_fd(), &byte, 1, MSG_PEEK | MSG_DONTWAIT);
  return got == 0 || (got < 0 && errno != EAGAIN && errno != EWOULDBLOCK && errno != EINTR);
}

static void move(layfigure_device* device, double dt) {
  double length = 0.0;
  int k;
  for (k = 0; k < 3; ++k) {
    device->position[k] += dt * device->speed * device->velocity[k];
    length += device->position[k] * device->position[k];
  }
  length = sqrt(length);
  if (length <= device->reach) return;
  for (k = 0; k < 3; ++k) device->position[k] *= device->reach / length;
}

/* q <- exp(dt turn_speed spin / 2) q */
static void turn(layfigure_device* device, double dt) {
  const double* s = device->spin;
  const double rate = device->turn_speed * sqrt(s[0] * s[0] + s[1] * s[1] + s[2] * s[2]);
  const double half = 0.5 * dt * rate;
  const double scale = rate > 0.0 ? sin(half) * device->turn_speed / rate : 0.0;
  const double w = cos(half), x = scale * s[0], y = scale * s[1], z = scale * s[2];
  double* q = device->rotation;
  const double turned[4] = {w * q[0] - x * q[1] - y * q[2] - z * q[3], w * q[1] + x * q[0] + y * q[3] - z * q[2],
                            w * q[2] - x * q[3] + y * q[0] + z * q[1], w * q[3] + x * q[2] - y * q[1] + z * q[0]};
  const double norm =
      sqrt(turned[0] * turned[0] + turned[1] * turned[1] + turned[2] * turned[2] + turned[3] * turned[3]);
  int k;
  for (k = 0; k < 4; ++k) q[k] = turned[k] / norm;
}

static int read_device(layfigure_device* device, double time, layfigure_device_state* state) {
  double dt = device->has_time ? time - device->time : 0.0;
  if (!(dt >= 0.0)) dt = 0.0;
  if (dt > LONGEST_STEP) dt = 0.0;
  device->time = time;
  device->has_time = 1;
  take_events(device);
  if (is_gone()) return LAYFIGURE_DEVICE_GONE;
  move(device, dt);
  turn(device, dt);
  memcpy(state->position, device->position, sizeof state->position);
  memcpy(state->rotation, device->rotation, sizeof state->rotation);
  state->grip = device->buttons & 1u ? 1.0 : 0.0;
  state->buttons = device->buttons;
  return LAYFIGURE_DEVICE_OK;
}

static void write_device(layfigure_device* device, const double force[3], const double torque[3]) {
  (void)device, (void)force, (void)torque;
}

static void get_exerted(const layfigure_device* device, double force[3], double torque[3]) {
  int k;
  (void)device;
  for (k = 0; k < 3; ++k) force[k] = torque[k] = 0.0;
}

static void close_device(layfigure_device* device) {
  spnav_close();
  is_open = 0;
  free(device);
}

const layfigure_device_functions* layfigure_device_plugin(void) {
  static const layfigure_device_functions functions = {
      LAYFIGURE_DEVICE_VERSION, open_device, get_info, read_device, write_device, get_exerted, close_device,
  };
  return &functions;
}
