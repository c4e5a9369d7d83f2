"""The faults of a campaign (docs/campaign.md) that apply to a state, one by one, as events of a fault script."""

import struct
from dataclasses import dataclass
from importlib import import_module
from pathlib import Path
from typing import Any, Dict, List, Optional, Sequence, Set, Tuple

from .._board import PathLike
from .._errors import InputError

#: The file of the repository, in a clone.
FAULTS = "tests/campaign/faults.toml"


@dataclass(frozen=True)
class Fault:
    """One fault."""

    group: str
    """Name in the file; no unit."""
    name: str
    """Its own name, with the bit or the number; no unit."""
    inject: Any
    """The word of a fault script, with its values; units are in its keys."""
    for_ms: Optional[float]
    """How long, ms; without it, to the end."""

    def script(self, after_ms: float, phase_us: float) -> str:
        """A fault script that injects it so long after the arming (ms), at a phase of the servo frame (us)."""
        lines = ["[[event]]", 'on = "armed"', f"after_ms = {after_ms!r}", f"phase_us = {phase_us!r}", f"inject = {_toml(self.inject)}"]
        return "\n".join(lines + ([] if self.for_ms is None else [f"for_ms = {self.for_ms!r}"])) + "\n"


def _toml(value: Any) -> str:
    if isinstance(value, dict):
        return "{ " + ", ".join(f"{key} = {_toml(one)}" for key, one in value.items()) + " }"
    if isinstance(value, bool):
        return "true" if value else "false"
    return f'"{value}"' if isinstance(value, str) else repr(value)


def of_file(path: PathLike, state: str, elf: PathLike) -> List[Fault]:
    """Every fault of a file that applies in a state; bits of the memory are those that the campaign draws for this image."""
    try:
        # Python 3.11, which MuJoCo needs too.
        toml = import_module("tomllib")
    except ImportError as error:
        raise ImportError("a file of faults needs Python 3.11 or newer, whose library reads TOML") from error
    try:
        content: Dict[str, List[Dict[str, Any]]] = toml.loads(Path(path).read_text(encoding="utf-8"))
    except ValueError as error:
        raise InputError(f"{path}: {error}") from error
    found: List[Fault] = []

    def add(entry: Dict[str, Any], name: str, inject: Any) -> None:
        found.append(Fault(entry["name"], name, inject, entry.get("for_ms")))

    for entry in [one for one in content.get("fault", []) if state in one["states"]]:
        add(entry, entry["name"], entry["inject"])
    for entry in [one for one in content.get("exceptions", []) if state in one["states"]]:
        for number in entry["numbers"]:
            add(entry, f"{entry['name']}, {number}", {"exception": {"number": number, "enable": entry.get("enable", False)}})
    for entry in [one for one in content.get("register", []) if state in one["states"]]:
        for bit in entry["bits"]:
            add(entry, f"{entry['name']}, bit {bit}", {"flip": {"address": entry["address"], "mask": 1 << bit}})
    for entry in [one for one in content.get("core", []) if state in one["states"]]:
        for register in entry["registers"]:
            for bit in entry["bits"]:
                add(entry, f"{entry['name']}, {register} bit {bit}", {"core-flip": {"register": register, "bit": bit}})
    for entry in [one for one in content.get("memory", []) if state in one["states"]]:
        for byte, bit in _drawn(entry, elf):
            mask = 1 << bit << (byte % 4 * 8)
            add(entry, f"{entry['name']}, {byte:#010x} bit {bit}", {"flip": {"address": byte & ~3, "mask": mask}})
    if not found:
        raise InputError(f"{path}: no fault applies in the state '{state}'")
    return found


def _drawn(entry: Dict[str, Any], elf: PathLike) -> List[Tuple[int, int]]:
    """Bytes and bits of the memory, as the virtual board's campaign draws them: SplitMix64 with the addresses as its seed."""
    addresses = symbols(elf, entry["symbols"])
    first, end = (addresses[name] for name in entry["symbols"])
    bits, state = (end - first) * 8, first << 32 | end
    places: Set[int] = set()
    while len(places) < entry["count"]:
        state = (state + 0x9E3779B97F4A7C15) % 2**64
        mixed = (state ^ state >> 30) * 0xBF58476D1CE4E5B9 % 2**64
        mixed = (mixed ^ mixed >> 27) * 0x94D049BB133111EB % 2**64
        places.add((mixed ^ mixed >> 31) % bits)
    return [(first + place // 8, place % 8) for place in sorted(places)]


def symbols(elf: PathLike, names: Sequence[str]) -> Dict[str, int]:
    """Addresses of symbols of a 32-bit little-endian ELF file; ``InputError`` if one is missing. No unit."""
    data = Path(elf).read_bytes()
    if data[:6] != b"\x7fELF\x01\x01":
        raise InputError(f"{elf}: no ELF file of 32 bits, little endian; allowed is an image of `cargo xtask build`")
    (sections_at,) = struct.unpack_from("<I", data, 32)
    size, count = struct.unpack_from("<HH", data, 46)
    sections = [struct.unpack_from("<10I", data, sections_at + number * size) for number in range(count)]
    found: Dict[str, int] = {}
    # The second word of a section is its kind, 2 that of symbols; then offset, length, and the section with their names.
    for table in [section for section in sections if section[1] == 2]:
        texts = sections[table[6]][4]
        for at in range(table[4], table[4] + table[5], 16):
            name_at, value = struct.unpack_from("<II", data, at)
            name = data[texts + name_at : data.index(b"\0", texts + name_at)].decode("ascii", "replace")
            if name in names:
                found[name] = value
    missing = [name for name in names if name not in found]
    if missing:
        raise InputError(f"{elf}: no symbol {', '.join(missing)}; a stripped image has none")
    return found
