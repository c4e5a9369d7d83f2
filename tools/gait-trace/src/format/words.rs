//! The words of joint names and of times in English, German, Dutch, French, Spanish, Italian and Portuguese: one table.
//!
//! A name is of one language: a side of one (`der` is right in Spanish) is not combined with a joint of another. Units, `flexion` and signs
//! are of all.

use crate::format::angle_unit::AngleUnit;

/// Meaning of a word in a name.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Word {
    Left,
    Right,
    Hip,
    Knee,
    Unit(AngleUnit),
    Flexion,
    Extension,
    Other,
}

use Word::{Extension, Flexion, Hip, Knee, Left, Other, Right};
const DEGREES: Word = Word::Unit(AngleUnit::Degrees);
const RADIANS: Word = Word::Unit(AngleUnit::Radians);

/// Words of every language.
pub(super) const COMMON: [(&str, Word); 31] = [
    ("l", Left),
    ("r", Right),
    ("degrees", DEGREES),
    ("degree", DEGREES),
    ("deg", DEGREES),
    ("°", DEGREES),
    ("º", DEGREES),
    ("grado", DEGREES),
    ("grados", DEGREES),
    ("gradi", DEGREES),
    ("graus", DEGREES),
    ("graden", DEGREES),
    ("degre", DEGREES),
    ("degres", DEGREES),
    ("degré", DEGREES),
    ("degrés", DEGREES),
    ("radians", RADIANS),
    ("radian", RADIANS),
    ("rad", RADIANS),
    ("flexion", Flexion),
    ("flex", Flexion),
    ("fe", Flexion),
    ("extension", Extension),
    ("ext", Extension),
    ("angle", Other),
    ("ang", Other),
    ("pitch", Other),
    ("sagittal", Other),
    ("plane", Other),
    ("x", Other),
    ("ik", Other),
];

/// The words of each language.
pub(super) const LANGUAGES: [&[(&str, Word)]; 7] = [
    &[
        ("left", Left),
        ("lt", Left),
        ("right", Right),
        ("rt", Right),
        ("hip", Hip),
        ("knee", Knee),
        ("angles", Other),
        ("joint", Other),
    ],
    // German
    &[
        ("links", Left),
        ("linke", Left),
        ("linker", Left),
        ("linkes", Left),
        ("li", Left),
        ("rechts", Right),
        ("rechte", Right),
        ("rechter", Right),
        ("rechtes", Right),
        ("re", Right),
        ("hüfte", Hip),
        ("hüft", Hip),
        ("huefte", Hip),
        ("hueft", Hip),
        ("knie", Knee),
        ("beugung", Flexion),
        ("streckung", Extension),
        ("winkel", Other),
        ("gelenk", Other),
        ("gelenkwinkel", Other),
    ],
    // Dutch
    &[
        ("links", Left),
        ("linker", Left),
        ("rechts", Right),
        ("rechter", Right),
        ("heup", Hip),
        ("knie", Knee),
        ("flexie", Flexion),
        ("buiging", Flexion),
        ("extensie", Extension),
        ("hoek", Other),
    ],
    // French
    &[
        ("gauche", Left),
        ("g", Left),
        ("droite", Right),
        ("droit", Right),
        ("d", Right),
        ("hanche", Hip),
        ("genou", Knee),
        ("angles", Other),
        ("de", Other),
        ("du", Other),
        ("la", Other),
    ],
    // Spanish
    &[
        ("izquierda", Left),
        ("izquierdo", Left),
        ("izq", Left),
        ("i", Left),
        ("derecha", Right),
        ("derecho", Right),
        ("der", Right),
        ("dcha", Right),
        ("dcho", Right),
        ("d", Right),
        ("cadera", Hip),
        ("rodilla", Knee),
        ("flexión", Flexion),
        ("extensión", Extension),
        ("ángulo", Other),
        ("angulo", Other),
        ("de", Other),
        ("la", Other),
    ],
    // Italian
    &[
        ("sinistra", Left),
        ("sinistro", Left),
        ("sin", Left),
        ("sx", Left),
        ("s", Left),
        ("destra", Right),
        ("destro", Right),
        ("dx", Right),
        ("d", Right),
        ("anca", Hip),
        ("ginocchio", Knee),
        ("flessione", Flexion),
        ("estensione", Extension),
        ("angolo", Other),
        ("dell", Other),
        ("del", Other),
    ],
    // Portuguese
    &[
        ("esquerda", Left),
        ("esquerdo", Left),
        ("esq", Left),
        ("e", Left),
        ("direita", Right),
        ("direito", Right),
        ("dir", Right),
        ("d", Right),
        ("anca", Hip),
        ("quadril", Hip),
        ("joelho", Knee),
        ("flexão", Flexion),
        ("flexao", Flexion),
        ("extensão", Extension),
        ("extensao", Extension),
        ("ângulo", Other),
        ("angulo", Other),
        ("da", Other),
        ("do", Other),
    ],
];

/// Names of a time, before a unit or alone: the last one is tried last.
pub(super) const TIMES: [&str; 7] = ["time", "zeit", "tijd", "temps", "tiempo", "tempo", "t"];

/// A second in words, in lower case.
pub(super) const SECONDS: [&str; 15] = [
    "s", "sec", "secs", "second", "seconds", "sek", "sekunde", "sekunden", "seconde", "seconden", "secondes", "seg",
    "segundos", "secondi", "secondo",
];
