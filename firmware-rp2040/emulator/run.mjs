// Runs the RP2040 image on rp2040js and prints what its pins did, as JSON; the raw bytes of its two RTT channels and of its serial port go to files.
//
//   node run.mjs IMAGE.uf2 SCENARIO.json LOG_FILE RECORDS_FILE SERIAL_FILE
//
// The scenario: {"secs": 12, "flash": [{"address": 269516800, "file": "robot.bin"}], "events": [{"s": 0.5, "pin": "emergency_stop", "level": false}],
// "volts": [{"mean": 1.5, "swing": 0.4, "hz": 1}], "hang_s": 3}. Pins of events: emergency_stop, button, foot_switch. `volts` has an entry a sensor.
// At `hang_s` the processor is stopped for good. With `unread` the channels are read at the end alone. An event {"s": 1, "usb": "send", "bytes": [1, 2]} is one of the host (host.mjs); {"s": 1, "core_reset":
// true} is a reset by a debugger. With {"drive": {"old": 0}} the flash is full of that byte, BOOTSEL is held at the power-on, and a computer copies the
// image to the drive of the boot ROM, which writes it to flash and restarts the chip; all times count from that restart. `flash` is written after it.

import { readFileSync, writeFileSync } from 'node:fs';
import { AT_REST, PINS, SUPPLY_V } from './board.mjs';
import { Chip, FLASH, FLASH_BYTES, pages } from './chip.mjs';
import { Computer } from './drive.mjs';
import { Host } from './host.mjs';

const MS = 1e6;

const [imageFile, scenarioFile, logFile, recordsFile, serialFile] = process.argv.slice(2);
if (serialFile === undefined) {
  console.error('usage: node run.mjs IMAGE.uf2 SCENARIO.json LOG_FILE RECORDS_FILE SERIAL_FILE');
  process.exit(2);
}
const scenario = JSON.parse(readFileSync(scenarioFile));
const image = readFileSync(imageFile);
const records = (scenario.flash ?? []).map(({ address, file }) => [address, readFileSync(file)]);

const levels = { ...AT_REST };
const edges = Object.fromEntries([...PINS.servos, PINS.servo_rail].map((pin) => [pin, []]));
const volts = scenario.volts ?? [];

const host = new Host();
/** What a person does with the drive: looks at its files, reads what it says about the board, and copies the image. */
const drive = {};
const computer = new Computer(function* (computer) {
  const { files, free } = yield* computer.mount();
  drive.files = Object.keys(files);
  drive.info = yield* computer.text(files['INFO_UF2TXT']);
  yield* computer.write(free, image);
});
/** When the program began, ns. */
let begun = 0;

function wire(mcu, chip) {
  (chip.bootsel ? computer : host).attach(mcu);
  for (const [name, level] of Object.entries(levels)) mcu.gpio[PINS[name]].setInputValue(level);
  volts.forEach(({ mean, swing = 0, hz = 0 }, channel) => {
    Object.defineProperty(mcu.adc.channelValues, channel, {
      get: () => Math.round(((mean + swing * Math.sin(2e-9 * Math.PI * hz * mcu.clock.nanos)) / SUPPLY_V) * 4095),
    });
  });
  // 27 degrees: 0.706 V.
  mcu.adc.channelValues[4] = Math.round((0.706 / SUPPLY_V) * 4095);
  for (const pin of Object.keys(edges)) {
    // A pin is high (1), or low, or not driven, which its pull-down makes low.
    const see = (state) => {
      const level = state === 1;
      const list = edges[pin];
      if (level !== (list.length % 2 === 1)) list.push(mcu.clock.nanos - begun);
    };
    // A reset lets go of the pins.
    see(mcu.gpio[pin].value);
    mcu.gpio[pin].addListener(see);
  }
}

/** Copies the image to the drive of the boot ROM, and returns the chip at its restart. */
function copied({ old }) {
  const LONGEST_NS = 60e9;
  const chip = new Chip([[FLASH, new Uint8Array(FLASH_BYTES).fill(old)]], wire, { bootsel: true });
  while (chip.resets.length === 0 && chip.nanos < LONGEST_NS) {
    chip.runTo(chip.nanos + MS);
    // The ROM has looked at the button.
    chip.bootsel = false;
  }
  if (chip.resets.length === 0) throw new Error(`the ROM did not restart: ${JSON.stringify(drive)}`);
  drive.flash_differs = pages(image).filter(([address, bytes]) => bytes.some((byte, n) => chip.mcu.flash[address - FLASH + n] !== byte)).map(([address]) => address);
  return chip;
}

const chip = scenario.drive ? copied(scenario.drive) : new Chip(pages(image), wire);
begun = chip.resetAt ?? 0;
chip.write(records);
const events = (scenario.events ?? []).map((event) => ({ ...event, at: begun + event.s * 1e9 })).sort((a, b) => a.at - b.at);
const end = begun + scenario.secs * 1e9;
let hung = false;
for (let now = begun; now < end; ) {
  const next = Math.min(now + MS, events[0]?.at ?? end, end);
  if (scenario.hang_s !== undefined && !hung && next >= begun + scenario.hang_s * 1e9) {
    hung = true;
    // A branch to itself, with interrupts masked: the processor hangs, the rest of the chip runs on.
    const { core } = chip.mcu;
    const at = 0x2003f000;
    chip.mcu.writeUint16(at, 0xe7fe);
    core.PM = true;
    core.waiting = false;
    core.PC = at;
  }
  chip.runTo(next);
  now = next;
  while (events.length > 0 && events[0].at <= now) {
    const { pin, level, usb, bytes, core_reset } = events.shift();
    if (core_reset) {
      chip.resetCore();
      continue;
    }
    if (usb !== undefined) {
      host.do(usb, bytes);
      continue;
    }
    levels[pin] = level;
    chip.mcu.gpio[PINS[pin]].setInputValue(level);
  }
  if (!scenario.unread) chip.drain();
}
// What is still there of channels that nobody has read.
chip.drain();
writeFileSync(logFile, Buffer.from(chip.channels[0]));
writeFileSync(recordsFile, Buffer.from(chip.channels[1]));
writeFileSync(serialFile, Buffer.from(host.received));
const named = (pin) => edges[pin];
console.log(
  JSON.stringify({
    secs: scenario.secs,
    core_hz: chip.mcu.clkSys,
    servos_ns: PINS.servos.map(named),
    servo_rail_ns: named(PINS.servo_rail),
    resets: chip.resets.map(({ s, reason }) => ({ s: s - begun / 1e9, reason })),
    drive,
    usb_connections: host.connections,
    messages: [...chip.messages.seen].sort(),
  }),
);
