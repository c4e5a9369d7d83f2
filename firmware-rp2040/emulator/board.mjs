// The board around the chip.

/** As in src/board.rs, which a test compares. */
export const PINS = { servos: [2, 3, 4, 5], servo_rail: 6, emergency_stop: 7, foot_switch: 8, button: 9, sync_output: 10, led: 25 };

/** The chip's supply, which is the reference of its converter. */
export const SUPPLY_V = 3.3;

/** Released, closed, no foot: as a person finds the board. */
export const AT_REST = { emergency_stop: true, button: true, foot_switch: false };

/** What arms it: the test of the emergency stop, and a hold of the button. */
export const ARMING = [
  { s: 0.15, pin: 'emergency_stop', level: false },
  { s: 0.25, pin: 'emergency_stop', level: true },
  { s: 0.3, pin: 'button', level: false },
  { s: 0.7, pin: 'button', level: true },
];
