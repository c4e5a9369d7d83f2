"""The body file: masses and lengths of a robot of one's own, in TOML."""

import math
from dataclasses import fields
from typing import Any, Dict, List, Tuple, Type, TypeVar, Union

from .. import Servo, servos
from .._errors import InputError
from .robots import Foot, Robot, Segment

Part = TypeVar("Part", Segment, Foot)

_HEAD = """# A planar biped: masses in kg, lengths in m. Both legs are equal. Along its segment, length_m goes from the upper joint to the next one, or to the
# sole; com_m from the upper joint to the centre of mass; the trunk's go up from the hip. gyration_m is the radius of gyration about the centre of mass;
# without it, that of a uniform rod, length_m / sqrt(12). The foot is an arc that is rigid with the shank: length_m along the arc, radius_m of it,
# forward_m from the shank's line to its middle. servo is one of {servos}; without servo and supply_v, `size` alone takes the body.
"""

#: Allowed values: least, most.
_ALLOWED: Dict[str, Tuple[float, float]] = {
    "mass_kg": (0.001, 200.0),
    "length_m": (0.01, 2.0),
    "com_m": (0.0, 2.0),
    "gyration_m": (0.001, 2.0),
    "radius_m": (0.01, 5.0),
    "forward_m": (-0.5, 0.5),
    "supply_v": (0.0, 30.0),
}


def text_of(robot: Robot) -> str:
    """The body file of a robot; no unit."""
    lines = [_HEAD.format(servos=", ".join(servos())) + f'name = "{robot.name}"']
    if robot.servo:
        lines += [f'servo = "{robot.servo}"', f"supply_v = {robot.supply_v!r}"]
    for name in ("trunk", "thigh", "shank", "foot"):
        part: Union[Segment, Foot] = getattr(robot, name)
        lines += ["", f"[{name}]", *(f"{field.name} = {getattr(part, field.name)!r}" for field in fields(part))]
    return "\n".join(lines)


def read(path: str) -> Robot:
    """The robot of a body file; units as in ``Robot``. ``InputError`` names file, table and key, and what is allowed."""
    # Of Python 3.11, which MuJoCo needs.
    import tomllib

    try:
        with open(path, "rb") as file:
            table = tomllib.load(file)
    except (tomllib.TOMLDecodeError, UnicodeDecodeError) as error:
        raise InputError(f"{path}: {error}") from None
    _keys(path, "", table, ["name", "trunk", "thigh", "shank", "foot"], ["servo", "supply_v"])
    name, servo = table["name"], table.get("servo", "")
    if not isinstance(name, str) or not name:
        raise InputError(f"{path}: name = {name!r}: allowed is a text that is not empty")
    if servo not in ("", *servos()):
        raise InputError(f"{path}: servo = {servo!r}: allowed is one of {', '.join(servos())}")
    if ("servo" in table) != ("supply_v" in table):
        raise InputError(f"{path}: servo and supply_v go together: give both or none")
    supply_v = _number(path, "supply_v", table["supply_v"], "supply_v") if servo else 0.0
    if servo:
        try:
            Servo(servo, supply_v=supply_v)
        except InputError as error:
            raise InputError(f"{path}: {error}") from None
    trunk, thigh, shank = (_part(path, part, table[part], Segment) for part in ("trunk", "thigh", "shank"))
    foot = _part(path, "foot", table["foot"], Foot)
    for part, segment in (("trunk", trunk), ("thigh", thigh), ("shank", shank)):
        if segment.com_m > segment.length_m:
            raise InputError(f"{path}: {part}.com_m = {segment.com_m:g}: allowed is 0 to its length_m, {segment.length_m:g}")
    if foot.length_m > math.pi * foot.radius_m:
        raise InputError(f"{path}: foot.length_m = {foot.length_m:g}: allowed is half a circle at most, {math.pi * foot.radius_m:g} m for its radius_m")
    return Robot(name, trunk, thigh, shank, foot, servo, supply_v)


def _part(path: str, name: str, table: Any, kind: Type[Part]) -> Part:
    """A segment or a foot from its table."""
    if not isinstance(table, dict):
        raise InputError(f"{path}: {name} is no table: write [{name}] and its keys below")
    every = [field.name for field in fields(kind)]
    without = ["gyration_m"] if kind is Segment else []
    _keys(path, f"[{name}] ", table, [key for key in every if key not in without], without)
    values = {key: _number(path, f"{name}.{key}", value, key) for key, value in table.items()}
    if kind is Segment:
        values.setdefault("gyration_m", values["length_m"] / 12.0**0.5)
    return kind(**values)


def _keys(path: str, where: str, table: Dict[str, Any], needed: List[str], optional: List[str]) -> None:
    for key in table:
        if key not in needed + optional:
            raise InputError(f"{path}: {where}unknown key `{key}`: allowed are {', '.join(needed + optional)}")
    missing = [key for key in needed if key not in table]
    if missing:
        raise InputError(f"{path}: {where}{', '.join(missing)} missing; `python -m footfall.body defaults` prints a whole file")


def _number(path: str, where: str, value: Any, key: str) -> float:
    least, most = _ALLOWED[key]
    if isinstance(value, bool) or not isinstance(value, (int, float)) or not least <= value <= most:
        raise InputError(f"{path}: {where} = {value!r}: allowed is {least:g} to {most:g}")
    return float(value)
