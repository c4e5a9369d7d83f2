// Steps a generator and the control loop, and prints what both gave: two objects in static memory, no heap.
//
// cc -I c/include c/examples/walk.c libfootfall_c.a -lm -lpthread -ldl -o walk

#include <stdio.h>

#include "footfall.h"

static FootfallGenerator walk;
static FootfallLoop joints;

int main(void) {
    FootfallError error;

    // A minute of the default walk, at 1 kHz.
    if (footfall_generator_gait(&walk, "walk", 1.0f, 1000, &error) != FOOTFALL_STATUS_OK) {
        fprintf(stderr, "%s\n", error.text);
        return 2;
    }
    for (int tick = 0; tick < 60000; tick++) {
        footfall_generator_step(&walk);
    }
    FootfallMotion motion;
    footfall_generator_motion(&walk, &motion);
    printf("angles %.9g %.9g %.9g %.9g phase %u\n", motion.angles_rad[0], motion.angles_rad[1], motion.angles_rad[2],
           motion.angles_rad[3], (unsigned)motion.phase);

    // Six seconds of the control loop of a board with its defaults: the emergency stop is tested, then a hold of the button arms.
    FootfallLoopConfig config = {.vrefint_cal = 1502, .min_supply_v = 2.7f, .sensor_required = true};
    if (footfall_loop_build(&joints, &config, &error) != FOOTFALL_STATUS_OK) {
        fprintf(stderr, "%s\n", error.text);
        return 2;
    }
    FootfallFrame frame;
    for (int tick = 1; tick <= 6000; tick++) {
        FootfallSample sample = {.vrefint = 1652, .elapsed = 1, .watchdog_measured = true, .watchdog_hz = 32000};
        // The sensor moves in a triangle, so that its code is that of a joint that moves.
        int place = tick % 1000;
        sample.codes[0] = (uint16_t)(1800 + (place < 500 ? place : 1000 - place));
        sample.fault_bits = tick >= 25 && tick < 50 ? 1 << 1 : 0;
        sample.button = tick > 100 && tick <= 700;
        footfall_loop_tick(&joints, &sample, &frame);
    }
    printf("tick %u state %u hash %016llx\n", (unsigned)frame.tick, frame.state, (unsigned long long)frame.setpoint_hash);

    // What is wrong is refused, with a text that says what is allowed.
    FootfallStatus refused = footfall_generator_gait(&walk, "walk", 9.0f, 1000, &error);
    printf("refused %d %s\n", (int)refused, error.text);
    static FootfallGenerator empty;
    printf("empty %d\n", (int)footfall_generator_step(&empty));
    return 0;
}
