/* The firmware on a pseudo-terminal: prints the terminal's name, then plays controller until its standard input ends.
 *
 * The log file is the truth about the outputs: a line an event, "MS EVENT ...", MS in simulated time since the program
 * started. Simulated time passes `speed` times as fast as the clock, but never more than kLongestStep at once: where
 * this program did not run for a while, no time has passed. Lines on standard input are orders: see `obey`. */
#define _XOPEN_SOURCE 700

#include <errno.h>
#include <fcntl.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/select.h>
#include <termios.h>
#include <time.h>
#include <unistd.h>

#include "../fw_controller.h"
#include "channel.h"

#define LONGEST_STEP_MS 20
#define BOOT_MS 200 /* from a restart until the controller listens again */

typedef struct {
  int terminal, other_end; /* the other end is held open, so that a host may come and go */
  FILE *log;
  double speed;
  uint64_t random;
  sim_faults faults;
  double reboot; /* probability, for each frame that arrives */
  uint32_t reboot_within_ms;

  uint64_t now_ms;
  uint64_t reboot_at_ms, boot_at_ms; /* 0: not planned */
  uint64_t note_at_ms; /* of the next line about a move */
  bool running, deaf, stopped, moving;
  uint32_t boots;
  sim_channel in, out;
  uint8_t inbox[8192]; /* a ring: what the firmware has not read yet */
  size_t inbox_first, inbox_count;
  uint8_t outbox[8192];
  size_t outbox_count;
  int32_t length_um[FW_MAX_WINCHES];

  fw_hal hal;
  fw_config config;
  fw_controller controller;
} simulator;

static void note(simulator *sim, const char *event) {
  fprintf(sim->log, "%llu %s\n", (unsigned long long)sim->now_ms, event);
  fflush(sim->log);
}

/* ---- the hardware ---- */

static uint32_t hal_time(void *self) {
  return (uint32_t)(((simulator *)self)->now_ms + 0xffff0000u); /* wraps around a minute after the start */
}

static int hal_read(void *self) {
  simulator *sim = self;
  uint8_t byte;
  if (sim->inbox_count == 0) return -1;
  byte = sim->inbox[sim->inbox_first];
  sim->inbox_first = (sim->inbox_first + 1) % sizeof sim->inbox;
  --sim->inbox_count;
  return byte;
}

static void hal_write(void *self, uint8_t byte) {
  simulator *sim = self;
  sim_put(&sim->out, byte, sim->now_ms);
}

static void hal_shutter(void *self, bool closed) {
  simulator *sim = self;
  const fw_controller *c = &sim->controller;
  char event[64];
  if (!closed) {
    note(sim, "shutter off");
    return;
  }
  snprintf(event, sizeof event, "shutter on %lu",
           (unsigned long)c->shots[(c->shot_next + FW_SHOTS - 1) % FW_SHOTS].number);
  note(sim, event);
}

static void hal_solenoid(void *self, bool on) { note(self, on ? "solenoid on" : "solenoid off"); }

static void hal_winches(void *self, const int32_t *length_um, uint8_t winches) {
  simulator *sim = self;
  memcpy(sim->length_um, length_um, winches * sizeof *length_um);
}

static bool hal_stopped(void *self) { return ((const simulator *)self)->stopped; }

static void boot(simulator *sim) {
  char event[64];
  uint32_t nonce;
  do nonce = (uint32_t)sim_random(&sim->random);
  while (nonce == 0);
  sim->inbox_count = 0;
  sim->running = true;
  sim->boot_at_ms = 0;
  snprintf(event, sizeof event, "boot %lu nonce %08lx", (unsigned long)++sim->boots, (unsigned long)nonce);
  note(sim, event);
  fw_controller_init(&sim->controller, &sim->hal, &sim->config, nonce);
}

/* Power fails: outputs fall off, all that the controller knew is gone. */
static void fail(simulator *sim) {
  sim->reboot_at_ms = 0;
  if (!sim->running) return;
  note(sim, sim->controller.exposing ? "reset exposing" : "reset");
  sim->running = false;
  sim->boot_at_ms = sim->now_ms + BOOT_MS;
  sim_clear(&sim->out);
}

/* ---- orders on standard input ---- */

static void obey(simulator *sim, const char *order) {
  if (!strcmp(order, "reset"))
    fail(sim);
  else if (!strcmp(order, "stop on"))
    sim->stopped = true;
  else if (!strcmp(order, "stop off"))
    sim->stopped = false;
  else if (!strcmp(order, "deaf on"))
    sim->deaf = true; /* the line is cut, both ways */
  else if (!strcmp(order, "deaf off"))
    sim->deaf = false;
  else
    return;
  note(sim, order);
}

static bool read_orders(simulator *sim) {
  static char line[64];
  static size_t length;
  char bytes[64];
  const ssize_t n = read(STDIN_FILENO, bytes, sizeof bytes);
  ssize_t i;
  for (i = 0; i < n; ++i) {
    if (bytes[i] == '\n') {
      line[length] = 0;
      obey(sim, line);
      length = 0;
    } else if (length + 1 < sizeof line) {
      line[length++] = bytes[i];
    }
  }
  return n > 0 || (n < 0 && (errno == EINTR || errno == EAGAIN));
}

/* ---- the line ---- */

static void read_line(simulator *sim) {
  uint8_t bytes[4096];
  const ssize_t n = read(sim->terminal, bytes, sizeof bytes);
  ssize_t i;
  if (n <= 0 || sim->deaf) return;
  for (i = 0; i < n; ++i)
    if (sim_put(&sim->in, bytes[i], sim->now_ms) && sim->running && !sim->reboot_at_ms && sim->reboot > 0 &&
        sim_uniform(&sim->random) < sim->reboot)
      sim->reboot_at_ms = sim->now_ms + 1 + sim_random(&sim->random) % sim->reboot_within_ms;
}

static void deliver(simulator *sim) {
  const sim_parcel *parcel;
  size_t i;
  while ((parcel = sim_take(&sim->in, sim->now_ms)))
    for (i = 0; i < parcel->length && sim->running && sim->inbox_count < sizeof sim->inbox; ++i)
      sim->inbox[(sim->inbox_first + sim->inbox_count++) % sizeof sim->inbox] = parcel->bytes[i];
  while ((parcel = sim_take(&sim->out, sim->now_ms))) {
    if (sim->deaf || sim->outbox_count + parcel->length > sizeof sim->outbox) continue;
    memcpy(sim->outbox + sim->outbox_count, parcel->bytes, parcel->length);
    sim->outbox_count += parcel->length;
  }
}

static void write_line(simulator *sim) {
  const ssize_t n = sim->outbox_count ? write(sim->terminal, sim->outbox, sim->outbox_count) : 0;
  if (n <= 0) return; /* nobody reads: the rest stays until the box is full */
  sim->outbox_count -= (size_t)n;
  memmove(sim->outbox, sim->outbox + n, sim->outbox_count);
}

static void note_lengths(simulator *sim, const char *what) {
  char event[256];
  size_t n = (size_t)snprintf(event, sizeof event, "%s", what);
  uint8_t i;
  for (i = 0; i < sim->config.winches; ++i)
    n += (size_t)snprintf(event + n, sizeof event - n, " %ld", (long)sim->length_um[i]);
  note(sim, event);
}

static void note_moves(simulator *sim) {
  const bool moving = sim->running && sim->controller.motion.path != FW_REST;
  if (moving != sim->moving) {
    sim->moving = moving;
    sim->note_at_ms = sim->now_ms + 25;
    note_lengths(sim, moving ? "moves" : "rests");
  } else if (moving && sim->now_ms >= sim->note_at_ms) {
    sim->note_at_ms += 25;
    note_lengths(sim, "at");
  }
}

static void hear(simulator *sim) {
  deliver(sim);
  if (sim->running) fw_controller_poll(&sim->controller);
  note_moves(sim);
  deliver(sim);
}

static void one_millisecond(simulator *sim) {
  ++sim->now_ms;
  if (sim->reboot_at_ms && sim->now_ms >= sim->reboot_at_ms) fail(sim);
  if (sim->boot_at_ms && sim->now_ms >= sim->boot_at_ms) boot(sim);
  hear(sim);
}

/* ---- start ---- */

static void die(const char *what) {
  perror(what);
  exit(1);
}

static void open_terminal(simulator *sim) {
  struct termios settings;
  const char *name;
  sim->terminal = posix_openpt(O_RDWR | O_NOCTTY);
  if (sim->terminal < 0 || grantpt(sim->terminal) || unlockpt(sim->terminal)) die("pseudo-terminal");
  name = ptsname(sim->terminal);
  if (!name || (sim->other_end = open(name, O_RDWR | O_NOCTTY)) < 0) die("pseudo-terminal");
  if (tcgetattr(sim->other_end, &settings)) die(name);
  settings.c_lflag &= ~(tcflag_t)(ECHO | ICANON | ISIG | IEXTEN);
  settings.c_oflag &= ~(tcflag_t)OPOST;
  settings.c_iflag &= ~(tcflag_t)(ICRNL | INLCR | IGNCR | IXON | ISTRIP | BRKINT | PARMRK);
  if (tcsetattr(sim->other_end, TCSANOW, &settings)) die(name);
  if (fcntl(sim->terminal, F_SETFL, O_NONBLOCK) || fcntl(STDIN_FILENO, F_SETFL, O_NONBLOCK)) die(name);
  puts(name);
  fflush(stdout);
}

static void configure(simulator *sim, uint8_t winches) {
  uint8_t i;
  sim->config.winches = winches;
  sim->config.max_exposure_ms = 10000;
  sim->config.max_solenoid_ms = 2000;
  for (i = 0; i < winches; ++i) {
    fw_limits *limits = &sim->config.built_in[i];
    limits->min_um = 50000;
    limits->max_um = 20000000;
    limits->speed_um_s = 800000;
    limits->acceleration_um_s2 = 600000;
  }
  sim->hal.self = sim;
  sim->hal.time_ms = hal_time;
  sim->hal.read_byte = hal_read;
  sim->hal.write_byte = hal_write;
  sim->hal.set_shutter = hal_shutter;
  sim->hal.set_solenoid = hal_solenoid;
  sim->hal.step_winches = hal_winches;
  sim->hal.emergency_stop = hal_stopped;
}

/* Waits until a byte or an order comes, a millisecond of the simulator's at most. */
static void wait_for_input(const simulator *sim, bool *bytes, bool *orders) {
  const struct timespec nap = {0, sim->speed > 1 ? (long)(1e6 / sim->speed) : 1000000};
  fd_set waiting;
  int n;
  FD_ZERO(&waiting);
  FD_SET(sim->terminal, &waiting);
  FD_SET(STDIN_FILENO, &waiting);
  n = pselect(sim->terminal + 1, &waiting, NULL, NULL, &nap, NULL);
  *bytes = n > 0 && FD_ISSET(sim->terminal, &waiting);
  *orders = n > 0 && FD_ISSET(STDIN_FILENO, &waiting);
}

static void run(simulator *sim) {
  struct timespec before, now;
  double due_ms = 0;
  bool bytes, orders;
  clock_gettime(CLOCK_MONOTONIC, &before);
  boot(sim);
  for (;;) {
    wait_for_input(sim, &bytes, &orders);
    if (orders && !read_orders(sim)) return;
    clock_gettime(CLOCK_MONOTONIC, &now);
    due_ms += sim->speed * ((double)(now.tv_sec - before.tv_sec) * 1e3 + (double)(now.tv_nsec - before.tv_nsec) * 1e-6);
    before = now;
    if (due_ms > LONGEST_STEP_MS) due_ms = LONGEST_STEP_MS;
    for (; due_ms >= 1; due_ms -= 1) one_millisecond(sim);
    if (bytes) {
      read_line(sim);
      hear(sim);
    }
    write_line(sim);
  }
}

static int usage(void) {
  fputs(
      "lumihull-firmware-sim --log FILE [--speed X] [--seed N] [--winches N] [--drop P] [--damage P] [--duplicate P]\n"
      "  [--delay P] [--max-delay MS] [--garbage P] [--reboot P] [--reboot-within MS]\n"
      "orders on standard input: reset, stop on|off, deaf on|off; its end ends the program\n",
      stderr);
  return 2;
}

int main(int argc, char **argv) {
  static simulator sim;
  const char *log = NULL;
  long winches = 6;
  int i;
  sim.speed = 1;
  sim.random = 1;
  sim.faults.max_delay_ms = 400;
  sim.reboot_within_ms = 100;
  for (i = 1; i + 1 < argc; i += 2) {
    const char *name = argv[i], *value = argv[i + 1];
    if (!strcmp(name, "--log"))
      log = value;
    else if (!strcmp(name, "--speed"))
      sim.speed = atof(value);
    else if (!strcmp(name, "--seed"))
      sim.random = strtoull(value, NULL, 10);
    else if (!strcmp(name, "--winches"))
      winches = atol(value);
    else if (!strcmp(name, "--drop"))
      sim.faults.drop = atof(value);
    else if (!strcmp(name, "--damage"))
      sim.faults.damage = atof(value);
    else if (!strcmp(name, "--duplicate"))
      sim.faults.duplicate = atof(value);
    else if (!strcmp(name, "--delay"))
      sim.faults.delay = atof(value);
    else if (!strcmp(name, "--max-delay"))
      sim.faults.max_delay_ms = (uint32_t)atol(value);
    else if (!strcmp(name, "--garbage"))
      sim.faults.garbage = atof(value);
    else if (!strcmp(name, "--reboot"))
      sim.reboot = atof(value);
    else if (!strcmp(name, "--reboot-within"))
      sim.reboot_within_ms = (uint32_t)atol(value);
    else
      return usage();
  }
  if (i != argc || !log || sim.speed <= 0 || winches < 0 || winches > FW_MAX_WINCHES || sim.reboot_within_ms < 1)
    return usage();
  sim.log = fopen(log, "w");
  if (!sim.log) die(log);
  sim.in.faults = sim.out.faults = &sim.faults;
  sim.in.random = sim.out.random = &sim.random;
  configure(&sim, (uint8_t)winches);
  open_terminal(&sim);
  run(&sim);
  return 0;
}
