// The functions of an ELF file for a 32-bit ARM: name, first address, bytes.

const [SECTIONS_AT, ENTRY_BYTES, COUNT] = [0x20, 0x2e, 0x30];
const [SYMBOL_TABLE, FUNCTION] = [2, 2];

/** Every function of the file's table of symbols, by address. */
export function functions(file) {
  const text = (from) => file.toString('latin1', from, file.indexOf(0, from));
  const section = (n) => {
    const at = file.readUInt32LE(SECTIONS_AT) + n * file.readUInt16LE(ENTRY_BYTES);
    const word = (place) => file.readUInt32LE(at + 4 * place);
    return { type: word(1), offset: word(4), size: word(5), link: word(6) };
  };
  const sections = Array.from({ length: file.readUInt16LE(COUNT) }, (_, n) => section(n));
  const table = sections.find(({ type }) => type === SYMBOL_TABLE);
  if (table === undefined) throw new Error('the file has no table of symbols');
  const names = sections[table.link].offset;
  const found = [];
  for (let at = table.offset; at < table.offset + table.size; at += 16) {
    if ((file[at + 12] & 0xf) !== FUNCTION) continue;
    // The lowest bit of the address says Thumb.
    const address = file.readUInt32LE(at + 4) & ~1;
    found.push({ name: text(names + file.readUInt32LE(at)), address, size: file.readUInt32LE(at + 8) });
  }
  return found.sort((a, b) => a.address - b.address);
}
