// Footfall for C and C++: generators and the control loop of the boards, without heap, in memory of the caller.
// Written from c/src by `FOOTFALL_WRITE_DOCS=1 cargo test -p footfall-c`. Angles are radians, flexion positive; the order of joints is
// left hip, right hip, left knee, right knee.

#ifndef FOOTFALL_H
#define FOOTFALL_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>
#if defined(_MSC_VER)
#define FOOTFALL_ALIGNED(n) __declspec(align(n))
#else
#define FOOTFALL_ALIGNED(n) __attribute__((aligned(n)))
#endif

// Bytes of the text of an error, with the zero at its end.
#define FOOTFALL_TEXT_BYTES 192

// Words of 8 bytes of a generator.
#define FOOTFALL_GENERATOR_WORDS 384

// Words of 8 bytes of a control loop.
#define FOOTFALL_LOOP_WORDS 1152

// What became of a call.
typedef enum {
  // It did what it says.
  FOOTFALL_STATUS_OK = 0,
  // A pointer is null, or an object was not built.
  FOOTFALL_STATUS_NOT_BUILT = 1,
  // No gait has this name.
  FOOTFALL_STATUS_UNKNOWN_NAME = 2,
  // A value is not a finite number.
  FOOTFALL_STATUS_NOT_FINITE = 3,
  // A value is out of its range.
  FOOTFALL_STATUS_OUT_OF_RANGE = 4,
  // The control period is 0 or too long.
  FOOTFALL_STATUS_PERIOD = 5,
  // A record cannot be read.
  FOOTFALL_STATUS_RECORD = 6,
  // The control loop cannot be built of its parts.
  FOOTFALL_STATUS_LOOP = 7,
} FootfallStatus;

// A generator of four joints. Its memory belongs to the caller, who sets it to zeros at first; it may be copied as a whole.
typedef struct FOOTFALL_ALIGNED(16) {
  // No meaning for callers.
  uint64_t words[FOOTFALL_GENERATOR_WORDS];
} FootfallGenerator;

// Why a build was refused.
typedef struct {
  // The kind of error.
  FootfallStatus status;
  // What is wrong, its value, and what is allowed: text in UTF-8 with a zero at its end.
  char text[FOOTFALL_TEXT_BYTES];
} FootfallError;

// The motion of a generator at one time.
typedef struct {
  // Joint angles, rad, flexion positive.
  float angles_rad[4];
  // Angular velocities, rad/s.
  float rates_rad_s[4];
  // Phase of the gait in units of 2^-32 cycles.
  uint32_t phase;
  // Whether it is a follower whose phase and stride frequency are known.
  bool locked;
  // Estimated stride time of the person, s; 0 for a generator that follows nobody.
  float stride_s;
} FootfallMotion;

// The control loop of a board at 1 kHz. Its memory belongs to the caller, who sets it to zeros at first; it may be copied as a whole.
typedef struct FOOTFALL_ALIGNED(16) {
  // No meaning for callers.
  uint64_t words[FOOTFALL_LOOP_WORDS];
} FootfallLoop;

// A record, as `footfall pack` writes it.
typedef struct {
  // Its bytes; null for the default.
  const uint8_t *bytes;
  // Their number.
  size_t length;
} FootfallRecord;

// Parts of a control loop.
typedef struct {
  // Generator; the default walk if it is null.
  FootfallRecord generator;
  // Sensors; one with the published curve if it is null.
  FootfallRecord sensors;
  // Robot; the default robot if it is null.
  FootfallRecord robot;
  // Factory code of the chip's reference.
  uint16_t vrefint_cal;
  // Lowest supply at which a sample is good, V, 1.8 to 3.6; that of the robot where it is higher.
  float min_supply_v;
  // Whether the joints move only while the sensors are good.
  bool sensor_required;
} FootfallLoopConfig;

// Inputs of one tick.
typedef struct {
  // Raw code of each sensor channel, 0 to 4095.
  uint16_t codes[4];
  // Raw code of the chip's reference.
  uint16_t vrefint;
  // Control periods since the last call: 1, or more where periods were missed.
  uint8_t elapsed;
  // Faults that the board found: bit 0 overrun, 1 break input, 2 clock, 3 watchdog, 4 outputs.
  uint8_t fault_bits;
  // A new measurement of the clock of the board's watchdog, Hz; read where `watchdog_measured` is set. One must come before the first arming.
  uint32_t watchdog_hz;
  // Whether `watchdog_hz` is a new measurement.
  bool watchdog_measured;
  // Debugger: 0 absent, 1 attached, 2 or more: attached and refused.
  uint8_t debugger;
  // The button is pressed.
  bool button;
  // The foot is on the floor.
  bool foot;
  // The tick began too late.
  bool late;
  // The program in flash is not proven to be the one that was built: the board does not arm.
  bool program_unproven;
} FootfallSample;

// Outputs of one tick.
typedef struct {
  // Control periods since the boot.
  uint32_t tick;
  // State of the supervisor: 0 boot, 1 disarmed, 2 arming, 3 walking, 4 stopping, 5 fault, 6 trim_ready, 7 trimming.
  uint8_t state;
  // Why the last motion ended or was refused, as a number; docs/safety.md has the names.
  uint8_t cause;
  // Setpoints, rad.
  float setpoints_rad[4];
  // Servo pulses, us; 0 while the outputs are off.
  uint16_t pulses_us[4];
  // Hash over every setpoint so far, as the board computes it.
  uint64_t setpoint_hash;
} FootfallFrame;

#ifdef __cplusplus
extern "C" {
#endif // __cplusplus

// Builds a gait by its name, such as `walk`, `natural-walk` or `human-walk`, at a factor `speed` on its own cadence, for a control period of
// `period_us` microseconds. `error` may be null.
//
// # Safety
// `generator` is null or points to a generator, `name` is null or a text with a zero at its end, `error` is null or points to an error;
// nobody else uses them during the call.
FootfallStatus footfall_generator_gait(FootfallGenerator *generator,
                                       const char *name,
                                       float speed,
                                       uint32_t period_us,
                                       FootfallError *error);

// Builds the generator of a record of `length` bytes, as `footfall pack` writes it from a generator file, for a control period of `period_us`
// microseconds. `error` may be null.
//
// # Safety
// `generator` is null or points to a generator, `record` is null or points to `length` bytes, `error` is null or points to an error;
// nobody else uses them during the call.
FootfallStatus footfall_generator_record(FootfallGenerator *generator,
                                         const uint8_t *record,
                                         size_t length,
                                         uint32_t period_us,
                                         FootfallError *error);

// Advances by one control period.
//
// # Safety
// `generator` is null or points to a generator of zeros or one that was built, and nobody else uses it during the call.
FootfallStatus footfall_generator_step(FootfallGenerator *generator);

// Returns to the state after the build.
//
// # Safety
// As `footfall_generator_step`.
FootfallStatus footfall_generator_reset(FootfallGenerator *generator);

// Reads the motion now.
//
// # Safety
// As `footfall_generator_step`; `motion` is null or points to a motion that nobody else uses during the call.
FootfallStatus footfall_generator_motion(FootfallGenerator *generator, FootfallMotion *motion);

// Sets the measured angle of the followed joint for the next step, rad, flexion positive; NaN if the sample is not valid. Other
// generators ignore it.
//
// # Safety
// As `footfall_generator_step`.
FootfallStatus footfall_generator_observe(FootfallGenerator *generator,
                                          float angle_rad);

// Builds a control loop at 1 kHz, before its first tick. `error` may be null.
//
// # Safety
// `joints` is null or points to a loop, `config` is null or points to a configuration whose records are null or have their bytes, `error` is null or
// points to an error; nobody else uses them during the call.
FootfallStatus footfall_loop_build(FootfallLoop *joints,
                                   const FootfallLoopConfig *config,
                                   FootfallError *error);

// Takes the sample of one tick and writes what the loop gives.
//
// # Safety
// `joints` is null or points to a loop of zeros or one that was built, `sample` and `frame` are null or point to theirs; nobody else uses them
// during the call.
FootfallStatus footfall_loop_tick(FootfallLoop *joints,
                                  const FootfallSample *sample,
                                  FootfallFrame *frame);

#ifdef __cplusplus
}  // extern "C"
#endif  // __cplusplus

#endif  /* FOOTFALL_H */
