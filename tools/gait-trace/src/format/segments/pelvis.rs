//! Computes a hip joint centre from the markers of the pelvis.
//!
//! With the origin in the middle of the anterior superior iliac spines (ASIS), z from the left to the right one, x forward in the plane of
//! the ASIS and the middle of the posterior ones (PSIS, or a marker on the sacrum) and y up, the centre is, in millimetres, at
//!
//! ```text
//! x = -0.24 PD - 9.9      y = -0.30 PW - 10.9      z = ±(0.33 PW + 7.3)
//! ```
//!
//! where PW is the distance between the ASIS and PD that between the middles of ASIS and PSIS (M. E. Harrington, A. B. Zavatsky, S. E. M.
//! Lawson, Z. Yuan, T. N. Theologis, Journal of Biomechanics 40 (2007) 595-602, equations of one variable). PW and PD are medians over the
//! recording. The constants are lengths, so the unit of the file is needed.

use crate::fault::Fault;
use crate::format::segments::vector::{Track, Vector, add, cross, length, mean_track, scale, square_to, sub, unit};
use crate::format::text_table::short;
use crate::series::median;

/// Markers of a pelvis, by indices of points, and the side of the hip.
pub(crate) struct Pelvis {
    /// The left and right ASIS.
    pub(super) anterior: [usize; 2],
    /// Both PSIS, or the sacrum.
    pub(super) posterior: Vec<usize>,
    pub(super) is_left: bool,
}

/// Distance of the ASIS of a person, from a small child to a large adult, millimetres.
const WIDTH_MM: std::ops::RangeInclusive<f64> = 100.0..=450.0;

/// The unit of length of a file: where it is named, and its text.
#[derive(Clone, Copy)]
pub(crate) struct LengthUnit<'a> {
    /// The field of the file.
    pub(crate) field: &'static str,
    /// Its text; empty if the file has none.
    pub(crate) text: &'a str,
}

impl LengthUnit<'_> {
    /// Millimetres of one unit. `width` is the distance of the ASIS, which must be a person's.
    fn millimetres(self, width: f64, notes: &mut Vec<String>) -> Result<f64, Fault> {
        let fault = |found: String, allowed: &str| {
            Err(Fault::HeaderField { field: self.field.into(), found, allowed: allowed.into() })
        };
        let named = match self.text.trim().to_lowercase().as_str() {
            "" => None,
            "mm" | "millimeter" | "millimeters" | "millimetre" | "millimetres" => Some(1.0),
            "cm" | "centimeter" | "centimeters" | "centimetre" | "centimetres" => Some(10.0),
            "m" | "meter" | "meters" | "metre" | "metres" => Some(1000.0),
            other => return fault(format!("`{}`", short(other)), "mm, cm or m"),
        };
        if let Some(named) = named {
            if WIDTH_MM.contains(&(width * named)) {
                return Ok(named);
            }
            let found =
                format!("`{}`, in which the anterior iliac spines are {} mm apart", self.text.trim(), width * named);
            return fault(found, "a unit in which they are 100 to 450 mm apart");
        }
        match [(1.0, "mm"), (10.0, "cm"), (1000.0, "m")]
            .into_iter()
            .find(|(unit, _)| WIDTH_MM.contains(&(width * unit)))
        {
            Some((unit, name)) => {
                let note = format!(
                    "The file names no unit of length; {name} is read, because the anterior iliac spines are {width:.3} apart."
                );
                if !notes.contains(&note) {
                    notes.push(note);
                }
                Ok(unit)
            }
            None => fault("missing".into(), &format!("mm, cm or m: the anterior iliac spines are {width} apart")),
        }
    }
}

impl Pelvis {
    pub(super) fn points(&self) -> Vec<usize> {
        [&self.anterior[..], &self.posterior].concat()
    }

    /// The trajectory of the hip joint centre; missing where a marker is.
    pub(super) fn hip(
        &self,
        mut track: impl FnMut(usize) -> Track,
        length_unit: LengthUnit<'_>,
        notes: &mut Vec<String>,
    ) -> Result<Track, Fault> {
        let [left, right] = self.anterior.map(&mut track);
        let back = mean_track(&self.posterior, track);
        let known = |values: Vec<f64>| median(values.into_iter().filter(|value| value.is_finite()));
        let middles: Track = left.iter().zip(&right).map(|(&left, &right)| scale(add(left, right), 0.5)).collect();
        let width = known(left.iter().zip(&right).map(|(&left, &right)| length(sub(left, right))).collect());
        let depth = known(middles.iter().zip(&back).map(|(&middle, &back)| length(sub(middle, back))).collect());
        let unit_mm = length_unit.millimetres(width, notes)?;
        let (width_mm, depth_mm) = (width * unit_mm, depth * unit_mm);
        let place_mm = [
            -0.24 * depth_mm - 9.9,
            -0.30 * width_mm - 10.9,
            if self.is_left { -1.0 } else { 1.0 } * (0.33 * width_mm + 7.3),
        ];
        let note = format!(
            "The hips are computed from the pelvis (Harrington and others 2007), which is {width_mm:.0} mm wide and {depth_mm:.0} mm deep."
        );
        if !notes.contains(&note) {
            notes.push(note);
        }
        let place = scale(place_mm, 1.0 / unit_mm);
        let hip = |n: usize| in_frame(left[n], right[n], middles[n], back[n], place).unwrap_or([f64::NAN; 3]);
        Ok((0..middles.len()).map(hip).collect())
    }
}

/// A place in the frame of a pelvis, in the laboratory.
fn in_frame(left: Vector, right: Vector, middle: Vector, back: Vector, place: Vector) -> Option<Vector> {
    let z = unit(sub(right, left))?;
    let x = unit(square_to(sub(middle, back), z))?;
    let y = cross(z, x);
    let [along_x, along_y, along_z] = place;
    Some(add(add(middle, scale(x, along_x)), add(scale(y, along_y), scale(z, along_z))))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Forward is +X, up is +Z, left is +Y: the equations, written out for a pelvis of 240 mm by 150 mm.
    #[test]
    fn the_equations_hold_in_every_unit() {
        for (text, mm) in [("mm", 1.0), ("cm", 10.0), ("m", 1000.0), ("", 1000.0)] {
            let points = [[100.0, 120.0, 900.0], [100.0, -120.0, 900.0], [-50.0, 0.0, 900.0]];
            let track = |n: usize| vec![scale(points[n], 1.0 / mm); 3];
            for (is_left, side) in [(true, 1.0), (false, -1.0)] {
                let pelvis = Pelvis { anterior: [0, 1], posterior: vec![2], is_left };
                let mut notes = Vec::new();
                let hip = pelvis.hip(track, LengthUnit { field: "POINT:UNITS", text }, &mut notes).unwrap();
                let wanted = [100.0 - 0.24 * 150.0 - 9.9, side * (0.33 * 240.0 + 7.3), 900.0 - 0.30 * 240.0 - 10.9];
                assert!(length(sub(scale(hip[1], mm), wanted)) < 1e-9, "{hip:?}");
                assert_eq!(notes.len(), if text.is_empty() { 2 } else { 1 }, "{notes:?}");
            }
        }
    }

    #[test]
    fn a_unit_that_makes_no_person_is_refused() {
        let of = |text: &str, width: f64| LengthUnit { field: "POINT:UNITS", text }.millimetres(width, &mut Vec::new());
        assert!(of("m", 240.0).unwrap_err().to_string().contains("240000 mm apart"));
        assert!(
            of("furlong", 240.0)
                .unwrap_err()
                .to_string()
                .contains("`POINT:UNITS` is `furlong`; allowed is mm, cm or m")
        );
        assert!(of("", 5000.0).unwrap_err().to_string().contains("the anterior iliac spines are 5000 apart"));
        assert!(of("", f64::NAN).is_err() && of("mm", 0.0).is_err());
    }
}
