// A sketch in the style of Arduino: setup() builds the control loop, loop() takes one sample a millisecond and sets four servos.
//
// The functions between the two lines stand for those of the board; put its own there. Compiled and run on the host by a test,
// not tried on an Arduino.

#include <cstdint>
#include <cstdio>

#include "footfall.h"

// ---- for the host ----
static std::uint32_t milliseconds = 0;
static std::uint32_t millis() { return milliseconds; }
static std::uint16_t analogRead(int pin) { return pin == 0 ? 1800 + (milliseconds / 2) % 500 : 1652; }
static bool digitalRead(int) { return milliseconds > 100 && milliseconds <= 700; }
static bool stopPressed() { return milliseconds >= 25 && milliseconds < 50; }
static std::uint16_t servos[4];
static void writeMicroseconds(int servo, std::uint16_t width) { servos[servo] = width; }
// ---- for the host ----

static const int SENSOR_PIN = 0, REFERENCE_PIN = 1, BUTTON_PIN = 2;
static FootfallLoop joints;
static std::uint32_t last;

void setup() {
    FootfallLoopConfig config = {};
    config.vrefint_cal = 1502;
    config.min_supply_v = 2.7f;
    FootfallError error;
    if (footfall_loop_build(&joints, &config, &error) != FOOTFALL_STATUS_OK) {
        std::printf("%s\n", error.text);
    }
    last = millis();
}

void loop() {
    const std::uint32_t now = millis();
    if (now == last) {
        return;
    }
    FootfallSample sample = {};
    sample.elapsed = static_cast<std::uint8_t>(now - last > 255 ? 255 : now - last);
    last = now;
    sample.codes[0] = analogRead(SENSOR_PIN);
    sample.vrefint = analogRead(REFERENCE_PIN);
    sample.button = digitalRead(BUTTON_PIN);
    // A board measures the clock of its watchdog; nominal here.
    sample.watchdog_measured = true;
    sample.watchdog_hz = 32000;
    sample.fault_bits = stopPressed() ? 1 << 1 : 0;
    FootfallFrame frame;
    if (footfall_loop_tick(&joints, &sample, &frame) != FOOTFALL_STATUS_OK) {
        return;
    }
    // 0 is no pulse: the outputs are off.
    for (int servo = 0; servo < 4; servo++) {
        writeMicroseconds(servo, frame.pulses_us[servo]);
    }
}

// An Arduino calls both by itself.
int main() {
    setup();
    for (milliseconds = 1; milliseconds <= 6000; milliseconds++) {
        loop();
    }
    std::printf("servos %d %d %d %d\n", servos[0], servos[1], servos[2], servos[3]);
    return 0;
}
