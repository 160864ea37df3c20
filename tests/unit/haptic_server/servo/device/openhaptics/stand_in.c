/* A stand-in for OpenHaptics' HD library: the same symbols and layouts, a servo thread, and an arm that really moves.
 *
 * Written from a description of the interface, for tests only. It judges its caller as a strict driver would: every call
 * at the wrong time or from the wrong thread is a violation, counted and put into words. Functions that begin with sim_
 * are the test's side: they set up the machine, break things, and tell what happened.
 */
#define _GNU_SOURCE
#include <math.h>
#include <pthread.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

typedef unsigned int HHD, HDuint, HDenum;
typedef int HDint;
typedef unsigned char HDboolean;
typedef unsigned short HDushort;
typedef unsigned long HDulong;
typedef double HDdouble;
typedef HDuint (*Callback)(void *);
typedef struct { HDuint code; HDint internal; HHD device; } ErrorInfo;

enum { NOBODY = 0xFFFFFFFFu, ARM = 7, LONGEST = 1 << 17, STACK = 256 };
enum { AT_BEGIN = 1, AT_END = 2 };

static pthread_mutex_t lock = PTHREAD_MUTEX_INITIALIZER; /* the error stack, the words and the log */
static ErrorInfo stack[STACK];
static int on_stack;
static char words[4096], diary[4096];
static int violations;

/* the machine, as the test sets it up */
static char configured[64];             /* the device's name; empty: the default one */
static int licence = 1, bus, style = 2, calibration = 0x5000, has_switch, stuck_capability;
static volatile int unplugged, is_nan, is_mute, is_frozen, goes_silent, switch_closed, buttons, flood;
static volatile unsigned raised, raised_where;
static volatile double temperature, stall_s;
static double x_mm, z_mm, nominal_stiffness = 3.5;

/* the arm: a mass on the spring and damper of a hand, along y */
static double y_mm = 30.0, vy_mm, held_y_mm = 30.0, mass_kg = 0.075, hand_N_per_mm = 0.06, hand_Ns_per_mm = 0.0005;

/* the servo */
static pthread_t servo;
static volatile int running, device_open, frame_open, frames;
static HDulong rate_Hz = 1000;
static struct { Callback call; void *argument; HDulong handle; } scheduled[4];
static HDulong last_handle;
static unsigned capabilities;
static double wanted[3], sent[3], read_mm[3];
static volatile long spent_ns, worst_gap_ns, due, called, sent_count, style_used, bad_at = -1;
static double sent_y[LONGEST], seen_y[LONGEST];

static long now_ns(void) {
    struct timespec t;
    clock_gettime(CLOCK_MONOTONIC, &t);
    return t.tv_sec * 1000000000L + t.tv_nsec;
}

static void violate(const char *form, ...) {
    va_list given;
    pthread_mutex_lock(&lock);
    violations++;
    size_t used = strlen(words);
    va_start(given, form);
    vsnprintf(words + used, sizeof words - used, form, given);
    va_end(given);
    used = strlen(words);
    snprintf(words + used, sizeof words - used, "; ");
    pthread_mutex_unlock(&lock);
}

static void note(const char *form, ...) {
    va_list given;
    pthread_mutex_lock(&lock);
    size_t used = strlen(diary);
    va_start(given, form);
    vsnprintf(diary + used, sizeof diary - used, form, given);
    va_end(given);
    used = strlen(diary);
    snprintf(diary + used, sizeof diary - used, " ");
    pthread_mutex_unlock(&lock);
}

static void push(HDuint code, HDint internal) {
    pthread_mutex_lock(&lock);
    if (on_stack < STACK) stack[on_stack++] = (ErrorInfo){code, internal, ARM};
    pthread_mutex_unlock(&lock);
}

static void went_bad(void) { if (bad_at < 0) bad_at = sent_count; } /* from the force with this number on */

static __thread int is_servo;
static int in_servo(void) { return is_servo; }

static int usable(const char *called) {
    if (device_open) return 1;
    violate("%s without an open device", called);
    push(0x0104, 0);
    return 0;
}

/* ---- errors ---- */
ErrorInfo hdGetError(void) {
    ErrorInfo newest = {0, 0, NOBODY};
    pthread_mutex_lock(&lock);
    if (on_stack > 0) newest = stack[--on_stack];
    pthread_mutex_unlock(&lock);
    return newest;
}

const char *hdGetErrorString(HDuint code) { return code == 0x0302 ? "communication" : "other"; }

/* For a process that the test only starts: STAND_IN_SWING="middle_mm size_mm period_s", STAND_IN_UNPLUG=ticks. */
static double swing_mm[3];
static long unplug_at = -1;

static void script(void) {
    const char *swing = getenv("STAND_IN_SWING"), *ticks = getenv("STAND_IN_UNPLUG");
    if (swing && sscanf(swing, "%lf %lf %lf", swing_mm, swing_mm + 1, swing_mm + 2) == 3) y_mm = swing_mm[0] + swing_mm[1];
    if (ticks) unplug_at = atol(ticks);
}

/* ---- the device ---- */
HHD hdInitDevice(const char *name) {
    note("init(%s)", name ? name : "NULL");
    script();
    if (unplug_at == 0) unplugged = 1;
    if (!licence) { push(0x0600, 11); return NOBODY; }
    if (device_open) { push(0x0301, 0); return NOBODY; }
    if (unplugged) { push(0x0302, 5); return NOBODY; }
    if (strcmp(name ? name : "", configured) != 0) { push(0x0300, 3); return NOBODY; }
    device_open = 1;
    return ARM;
}

void hdMakeCurrentDevice(HHD device) {
    if (device != ARM) violate("current device %u", device);
}

void hdDisableDevice(HHD device) {
    note("disable");
    if (!usable("hdDisableDevice")) return;
    if (device != ARM) violate("disabled device %u", device);
    if (running) violate("disabled while the scheduler runs");
    device_open = 0;
}

void hdEnable(HDenum what) {
    if (!usable("hdEnable")) return;
    note("enable(%x)", what);
    if ((int)what == stuck_capability) return;
    if (what < 0x4000 || what > 0x4004) push(0x0100, 0); else capabilities |= 1u << (what - 0x4000);
}

void hdDisable(HDenum what) {
    if (!usable("hdDisable")) return;
    note("off(%x)", what);
    if (unplugged) { push(0x0302, 7); return; }
    if (what < 0x4000 || what > 0x4004) push(0x0100, 0); else capabilities &= ~(1u << (what - 0x4000));
}

HDboolean hdIsEnabled(HDenum what) { return (HDboolean)((capabilities >> (what - 0x4000)) & 1u); }

/* ---- frames ---- */
static int framed(const char *called) {
    if (!in_servo()) { violate("%s outside the servo thread", called); return 0; }
    if (frame_open) return 1;
    violate("%s outside a frame", called);
    return 0;
}

void hdBeginFrame(HHD device) {
    if (!usable("hdBeginFrame")) return;
    if (device != ARM) violate("frame of device %u", device);
    if (!in_servo()) violate("frame outside the servo thread");
    if (frame_open) { violate("begun twice"); push(0x0400, 0); }
    if (++frames > 1) { violate("a second frame in a tick"); push(0x0402, 0); }
    frame_open = 1;
    wanted[0] = wanted[1] = wanted[2] = 0.0;
    if (!is_frozen) { read_mm[0] = x_mm; read_mm[1] = is_nan ? NAN : y_mm; read_mm[2] = z_mm; }
    if (is_nan || is_mute || is_frozen || (has_switch && !switch_closed)) went_bad();
    if (unplugged) { went_bad(); push(0x0302, 5); }
    if (temperature >= 1.0) { went_bad(); push(0x0200, 0); }
    if (raised && raised_where == AT_BEGIN) { went_bad(); push(raised, 42); raised = 0; }
    for (int i = 0; i < flood; i++) push(0x0203, i);
}

void hdEndFrame(HHD device) {
    if (!usable("hdEndFrame")) return;
    if (device != ARM) violate("frame of device %u", device);
    if (!frame_open) { violate("ended without a frame"); push(0x0401, 0); return; }
    frame_open = 0;
    double size = sqrt(wanted[0] * wanted[0] + wanted[1] * wanted[1] + wanted[2] * wanted[2]);
    if (!(size < INFINITY)) violate("a force that is no number");
    if (size > 8.5 && !(capabilities & 2u)) push(0x0201, 0);
    memcpy(sent, wanted, sizeof sent);
    if (sent_count < LONGEST) { sent_y[sent_count] = wanted[1]; seen_y[sent_count] = read_mm[1]; sent_count++; }
    if (wanted[0] != 0.0 || wanted[2] != 0.0) violate("a force beside y");
    if (unplugged) push(0x0302, 6);
    if (raised && raised_where == AT_END) { went_bad(); push(raised, 43); raised = 0; }
}

/* ---- values ---- */
void hdGetDoublev(HDenum what, HDdouble *out) {
    if (!usable("hdGetDoublev")) return;
    switch (what) {
    case 0x2050: /* what a test changes amid a frame is bad from this frame on */
        if (!framed("position")) return;
        if (unplugged || is_mute) went_bad(); else memcpy(out, read_mm, sizeof read_mm);
        return;
    case 0x2605: for (int i = 0; i < 3; i++) out[i] = temperature * (i == 1 ? 1.0 : 0.5); return;
    case 0x2505: *out = 192.0; return;
    case 0x2550: memcpy(out, (double[]){-300, -200, -120, 300, 300, 120}, 48); return;
    case 0x2551: memcpy(out, (double[]){-190.5, -80, -95.5, 190.5, 187, 95.5}, 48); return;
    case 0x2602: *out = nominal_stiffness; return;
    case 0x2603: *out = 8.5; return;
    case 0x2604: *out = 1.4; return;
    case 0x2606: *out = 800.0; return;
    case 0x2607: *out = 0.4; return;
    case 0x2608: *out = 3.0; return;
    case 0x2609: *out = 0.003; return;
    default: push(0x0100, 0);
    }
}

void hdSetDoublev(HDenum what, const HDdouble *in) {
    if (!usable("hdSetDoublev")) return;
    if (what != 0x2700) { push(0x0100, 0); return; }
    if (framed("force")) memcpy(wanted, in, sizeof wanted);
}

void hdGetIntegerv(HDenum what, HDint *out) {
    if (!usable("hdGetIntegerv")) return;
    switch (what) {
    case 0x2000: if (framed("buttons") && !is_mute) *out = buttons; return;
    case 0x2555: *out = style; return;
    case 0x2600: *out = (HDint)rate_Hz; return;
    case 0x2601: *out = (HDint)rate_Hz; return;
    default: push(0x0100, 0);
    }
}

void hdGetBooleanv(HDenum what, HDboolean *out) {
    if (!usable("hdGetBooleanv")) return;
    if (what != 0x2001 || !has_switch) { push(0x0103, 0); return; }
    *out = (HDboolean)switch_closed;
    if (frame_open && !*out) went_bad();
}

const char *hdGetString(HDenum what) {
    switch (what) {
    case 0x2500: return "3.00";
    case 0x2501: return "PHANTOM Premium 1.5";
    case 0x2502: return "4.2";
    case 0x2503: return "stand-in";
    case 0x2504: return "12345";
    default: push(0x0100, 0); return NULL;
    }
}

/* ---- calibration ---- */
HDenum hdCheckCalibration(void) { return usable("hdCheckCalibration") ? (HDenum)calibration : 0; }

void hdUpdateCalibration(HDenum chosen) {
    if (!usable("hdUpdateCalibration")) return;
    note("calibrate(%u)", chosen);
    style_used = (long)chosen;
    if (!(style & (int)chosen)) push(0x0101, 0);
    else if (calibration == 0x5001 || chosen == 1) calibration = 0x5000;
}

/* ---- the scheduler ---- */
void hdSetSchedulerRate(HDulong wished) {
    note("rate(%lu)", wished);
    int found = wished == 500 || wished == 1000 || wished == 2000;
    for (int n = 4; bus == 1 && n <= 16; n++) found |= wished == (HDulong)floor(8000.0 / n + 0.5);
    if (!found || bus == 2) { push(0x0101, 0); return; }
    rate_Hz = wished;
}

static void move_arm(double span_s) { /* F held; fine steps, semi-implicit */
    double force = (capabilities & 1u) && !unplugged ? sent[1] : 0.0;
    int steps = (int)(span_s / 1e-4) + 1;
    double h = span_s / steps;
    for (int i = 0; i < steps; i++) {
        double all = force - hand_N_per_mm * (y_mm - held_y_mm) - hand_Ns_per_mm * vy_mm;
        vy_mm += h * 1e3 * all / mass_kg;
        y_mm += h * vy_mm;
    }
}

static void follow_script(void) {
    if (swing_mm[2] > 0.0)
        held_y_mm = swing_mm[0] + swing_mm[1] * cos(2.0 * M_PI * (double)due / (double)rate_Hz / swing_mm[2]);
    if (unplug_at >= 0 && called >= unplug_at) unplugged = 1;
}

static void one_tick(void) {
    frames = 0;
    frame_open = 0;
    for (int i = 0; i < 4; i++)
        if (scheduled[i].call) {
            called++;
            long start = now_ns();
            HDuint answer = scheduled[i].call(scheduled[i].argument);
            spent_ns += now_ns() - start;
            if (answer == 0) { scheduled[i].call = NULL; note("done"); }
            if (frame_open) violate("a frame left open");
            if (frames == 0) violate("a tick without a frame");
        }
    if (on_stack > flood) violate("%d errors left on the stack", on_stack);
}

static void *serve(void *unused) {
    (void)unused;
    is_servo = 1;
    long period = 1000000000L / (long)rate_Hz, next = now_ns() + period, last = now_ns();
    while (running) {
        struct timespec until = {next / 1000000000L, next % 1000000000L};
        clock_nanosleep(CLOCK_MONOTONIC, TIMER_ABSTIME, &until, NULL);
        if (stall_s > 0.0) {
            struct timespec pause = {0, (long)(stall_s * 1e9)};
            stall_s = 0.0;
            nanosleep(&pause, NULL);
        }
        long now = now_ns(), ticks = (now - next) / period + 1;
        due += ticks;
        next += ticks * period;
        follow_script();
        move_arm((now - last) * 1e-9);
        if (now - last > worst_gap_ns) worst_gap_ns = now - last;
        last = now;
        if (!goes_silent) one_tick();
    }
    return NULL;
}

void sim_tick(double span_s) { /* in the place of the servo thread: one tick, on the caller's thread and clock */
    if (running) { violate("stepped while the scheduler runs"); return; }
    is_servo = 1;
    due++;
    move_arm(span_s);
    one_tick();
    is_servo = 0;
}

HDulong hdScheduleAsynchronous(Callback call, void *argument, HDushort priority) {
    note("schedule(%u)", priority);
    usable("hdScheduleAsynchronous");
    for (int i = 0; i < 4; i++)
        if (!scheduled[i].call) {
            scheduled[i].argument = argument;
            scheduled[i].handle = ++last_handle;
            scheduled[i].call = call;
            return last_handle;
        }
    push(0x0501, 0);
    return 0;
}

void hdUnschedule(HDulong handle) {
    note("unschedule");
    if (running) violate("unscheduled while the scheduler runs");
    for (int i = 0; i < 4; i++) if (scheduled[i].handle == handle) scheduled[i].call = NULL;
    if (handle == 0 || handle > last_handle) violate("unscheduled handle %lu", handle);
}

void hdStartScheduler(void) {
    note("start");
    if (!usable("hdStartScheduler")) return;
    if (running) { violate("started twice"); return; }
    running = 1;
    if (pthread_create(&servo, NULL, serve, NULL) != 0) { running = 0; push(0x0304, 0); }
}

void hdStopScheduler(void) {
    note("stop");
    if (!running) { violate("stopped twice"); return; }
    if (in_servo()) { violate("stopped from the servo thread"); return; }
    running = 0;
    pthread_join(servo, NULL);
}

/* ---- the test's side ---- */
static pthread_t witness;
static volatile int watching;
static volatile long witnessed;

static void *watch(void *unused) { /* as `serve`, with nothing to call: how many ticks the machine lets a thread make */
    (void)unused;
    long period = 1000000000L / (long)rate_Hz, next = now_ns() + period;
    while (watching) {
        struct timespec until = {next / 1000000000L, next % 1000000000L};
        clock_nanosleep(CLOCK_MONOTONIC, TIMER_ABSTIME, &until, NULL);
        next += ((now_ns() - next) / period + 1) * period;
        witnessed++;
    }
    return NULL;
}

void sim_watch(int on) {
    if (on) witnessed = 0;
    watching = on;
    if (!on) pthread_join(witness, NULL);
    else if (pthread_create(&witness, NULL, watch, NULL) != 0) { watching = 0; violate("no thread to watch"); }
}
long sim_witnessed(void) { return witnessed; }
void sim_configure(const char *name) { snprintf(configured, sizeof configured, "%s", name); }
void sim_licence(int valid) { licence = valid; }
void sim_bus(int kind) { bus = kind; } /* 0 card, 1 FireWire, 2 refuses every rate */
void sim_calibration(int offered, int status) { style = offered; calibration = status; }
void sim_stiffness(double told) { nominal_stiffness = told; }
void sim_stuck(int capability) { stuck_capability = capability; }
void sim_switch(int present, int closed) { switch_closed = closed; has_switch = present; }
void sim_buttons(int pressed) { buttons = pressed; }
void sim_place(double x, double y, double z) { x_mm = x; y_mm = held_y_mm = y; z_mm = z; vy_mm = 0.0; }
void sim_hand(double y) { held_y_mm = y; }
void sim_swing(double middle, double size, double period_s) { /* the hand goes up and down from now on */
    swing_mm[0] = middle;
    swing_mm[1] = size;
    swing_mm[2] = period_s;
}
void sim_unplug(int out) { unplugged = out; }
void sim_nan(int on) { is_nan = on; }
void sim_mute(int on) { is_mute = on; } /* getters write nothing and report nothing */
void sim_freeze(int on) { is_frozen = on; } /* the arm moves on; what is told stays as it was */
void sim_silence(int on) { goes_silent = on; }
void sim_stall(double seconds) { stall_s = seconds; }
void sim_warm(double share) { temperature = share; }
void sim_raise(unsigned code, unsigned where) { raised_where = where; raised = code; }
void sim_flood(int each_tick) { flood = each_tick; }
long sim_called(void) { return called; }
/* Wait for so many ticks more, in C: how many came, which are fewer only after a minute. */
long sim_await(long more) {
  struct timespec pause = {0, 1000000};
  long begun = called;
  for (int look = 0; look < 120000 && called < begun + more; look++) nanosleep(&pause, NULL);
  return called - begun;
}
/* Wait until the witness has ticked so often, a minute at most: how many ticks were called meanwhile. */
long sim_called_beside(long ticks) {
  struct timespec pause = {0, 1000000};
  long begun = called;
  for (int look = 0; look < 120000 && witnessed < ticks; look++) nanosleep(&pause, NULL);
  return called - begun;
}
long sim_bad_at(void) { return bad_at; }
long sim_style_used(void) { return style_used; }
int sim_violations(void) { return violations; }
const char *sim_words(void) { return words; }
const char *sim_diary(void) { return diary; }
double sim_height(void) { return y_mm; }
double sim_force(void) { return sent[1]; }
double sim_mean_call(void) { return called ? spent_ns * 1e-9 / called : 0.0; } /* what a callback takes, s */
double sim_worst_gap(void) { return worst_gap_ns * 1e-9; } /* the longest time between two ticks, s */

/* Forces along y that frames were ended with, and the height that each had been told; at most `room` newest. */
long sim_sent(double *forces, double *heights, long room) {
    long all = sent_count, first = all > room ? all - room : 0;
    memcpy(forces, sent_y + first, (size_t)(all - first) * sizeof(double));
    memcpy(heights, seen_y + first, (size_t)(all - first) * sizeof(double));
    return all - first;
}

/* Sizes and offsets as this compiler lays them out. */
long sim_layout(int which) {
    switch (which) {
    case 0: return sizeof(ErrorInfo);
    case 1: return offsetof(ErrorInfo, code);
    case 2: return offsetof(ErrorInfo, internal);
    case 3: return offsetof(ErrorInfo, device);
    case 4: return sizeof(HHD);
    case 5: return sizeof(HDenum);
    case 6: return sizeof(HDint);
    case 7: return sizeof(HDboolean);
    case 8: return sizeof(HDushort);
    case 9: return sizeof(HDulong);
    case 10: return sizeof(HDdouble);
    default: return -1;
    }
}
