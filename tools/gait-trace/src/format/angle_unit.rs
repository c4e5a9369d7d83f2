//! The unit of angles, and its names.

/// The unit of angles.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum AngleUnit {
    /// 360 per turn.
    Degrees,
    /// 2 pi per turn.
    Radians,
}

impl AngleUnit {
    /// Converts an angle of this unit to degrees.
    ///
    /// ```
    /// use gait_trace::format::angle_unit::AngleUnit;
    /// assert_eq!(AngleUnit::Radians.degrees(std::f64::consts::PI), 180.0);
    /// ```
    #[must_use]
    pub fn degrees(self, value: f64) -> f64 {
        match self {
            Self::Degrees => value,
            Self::Radians => value.to_degrees(),
        }
    }

    /// Name of the unit.
    #[must_use]
    pub const fn words(self) -> &'static str {
        match self {
            Self::Degrees => "degrees",
            Self::Radians => "radians",
        }
    }
}

impl std::str::FromStr for AngleUnit {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        // `Grad` is the German word for degrees; `grad` is a hundredth of a right angle.
        if text == "Grad" {
            return Ok(Self::Degrees);
        }
        match text.to_lowercase().as_str() {
            "deg" | "degree" | "degrees" | "°" | "º" | "grado" | "grados" | "degre" | "degres" | "degré" | "degrés"
            | "gradi" | "graus" | "graden" => Ok(Self::Degrees),
            "rad" | "radian" | "radians" => Ok(Self::Radians),
            _ => Err(format!("unit `{text}`; allowed are degrees, radians")),
        }
    }
}
