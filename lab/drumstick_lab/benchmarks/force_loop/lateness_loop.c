/* The force loop's skeleton in C, to be timed beside ours: absolute deadlines, the same priority and the same wishes.

   lateness_loop FIRST_NS PERIOD_NS TICKS SPIN_NS CPU PRIORITY FILE

   FIRST_NS is the first deadline on CLOCK_MONOTONIC; CPU -1 leaves the thread to the system. As in
   haptic_server/servo/priority.py: SCHED_FIFO, memory locked on fault, timer slack 1 ns. FILE receives TICKS pairs of
   int64, native order: when each tick was due and how late it came, ns. Prints one JSON object of what was granted.
   Nothing is allocated or written while it runs; an overrun is skipped, as ours is. */
#define _GNU_SOURCE
#include <errno.h>
#include <inttypes.h>
#include <sched.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/mman.h>
#include <sys/prctl.h>
#include <time.h>

#ifndef MCL_ONFAULT
#define MCL_ONFAULT 4
#endif

static int64_t now_ns(void)
{
    struct timespec t;
    clock_gettime(CLOCK_MONOTONIC, &t);
    return (int64_t)t.tv_sec * 1000000000 + t.tv_nsec;
}

static void wait_until(int64_t deadline, int64_t spin)
{
    struct timespec t = {(deadline - spin) / 1000000000, (deadline - spin) % 1000000000};
    clock_nanosleep(CLOCK_MONOTONIC, TIMER_ABSTIME, &t, NULL);
    while (spin > 0 && now_ns() < deadline)
        ;
}

static const char *said(int result)
{
    return result == 0 ? "granted" : strerror(errno);
}

static void claim(int cpu, int priority)
{
    struct sched_param fifo = {.sched_priority = priority};
    cpu_set_t set;
    printf("{\"scheduler\": \"%s\", ", said(sched_setscheduler(0, SCHED_FIFO, &fifo)));
    printf("\"memory\": \"%s\", ", said(mlockall(MCL_CURRENT | MCL_FUTURE | MCL_ONFAULT)));
    printf("\"timer_slack\": \"%s\", ", said(prctl(PR_SET_TIMERSLACK, 1, 0, 0, 0)));
    CPU_ZERO(&set);
    if (cpu >= 0)
        CPU_SET(cpu, &set);
    printf("\"affinity\": \"%s\"}\n", cpu < 0 ? "left to the system" : said(sched_setaffinity(0, sizeof set, &set)));
    fflush(stdout);
}

static void loop(int64_t *kept, int64_t ticks, int64_t deadline, int64_t period, int64_t spin)
{
    for (int64_t tick = 0; tick < ticks;) {
        wait_until(deadline, spin);
        int64_t lateness = now_ns() - deadline;
        if (lateness < 0)
            continue; /* a signal ended the sleep */
        kept[2 * tick] = deadline;
        kept[2 * tick + 1] = lateness;
        tick++;
        deadline += ((now_ns() - deadline) / period + 1) * period;
    }
}

int main(int argc, char **argv)
{
    if (argc != 8) {
        fprintf(stderr, "lateness_loop FIRST_NS PERIOD_NS TICKS SPIN_NS CPU PRIORITY FILE\n");
        return 2;
    }
    int64_t ticks = atoll(argv[3]);
    int64_t *kept = malloc(2 * ticks * sizeof *kept);
    if (kept == NULL) {
        perror("lateness_loop");
        return 3;
    }
    memset(kept, 0, 2 * ticks * sizeof *kept);
    claim(atoi(argv[5]), atoi(argv[6]));
    loop(kept, ticks, atoll(argv[1]), atoll(argv[2]), atoll(argv[4]));
    FILE *file = fopen(argv[7], "wb");
    if (file == NULL || fwrite(kept, 2 * sizeof *kept, ticks, file) != (size_t)ticks || fclose(file) != 0) {
        perror(argv[7]);
        return 3;
    }
    return 0;
}
