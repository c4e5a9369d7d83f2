//! A walker's parameters as TOML: the shortest numbers that read back to the same bits.

use std::fmt::Write as _;

use joint_units::Joint;

use super::{GeneratorFile, GeneratorSet, LINKS, PROVENANCE, Provenance, RobustSet, SCHEMA, ShapeSet, ThesisSet};

impl GeneratorFile {
    /// As a file's text.
    #[must_use]
    pub fn to_toml(&self) -> String {
        let mut out = String::new();
        let Provenance { source, source_sha256, made_by, settings } = &self.provenance;
        // Writing to a String cannot fail.
        let _ = writeln!(out, "schema = {SCHEMA}\ngenerator = \"{}\"\n\n[provenance]", self.set.kind());
        for (key, value) in PROVENANCE.into_iter().zip([source, source_sha256, made_by, settings]) {
            let _ = writeln!(out, "{key} = {}", quoted(value));
        }
        let _ = match &self.set {
            GeneratorSet::Robust(set) => write_robust(&mut out, set),
            GeneratorSet::Thesis(set) => write_thesis(&mut out, set),
            GeneratorSet::Shape(set) => write_shape(&mut out, "shape", "", set),
            GeneratorSet::Follow(set) => {
                let first = format!("sensor = \"{}\"\nevents = \"{}\"\n", set.sensor.name(), set.events.name());
                write_shape(&mut out, "follow", &first, &set.shape)
            }
        };
        out
    }
}

/// As a basic string on one line.
fn quoted(text: &str) -> String {
    let mut out = String::from("\"");
    for c in text.chars() {
        match c {
            '"' | '\\' => out.extend(['\\', c]),
            c if c.is_control() => out += &format!("\\u{:04X}", u32::from(c)),
            c => out.push(c),
        }
    }
    out + "\""
}

fn list(numbers: &[f32]) -> String {
    let numbers: Vec<String> = numbers.iter().map(|number| format!("{number:?}")).collect();
    format!("[{}]", numbers.join(", "))
}

fn write_robust(out: &mut String, set: &RobustSet) -> std::fmt::Result {
    writeln!(out, "\n[robust]\nnatural_period_s = {:?}\nnonlinearity = {:?}", set.natural_period_s, set.nonlinearity)?;
    writeln!(out, "\n[robust.coupling]")?;
    for (name, kap) in LINKS.into_iter().zip(set.coupling) {
        writeln!(out, "{name} = {kap:?}")?;
    }
    for (name, joint) in Joint::ALL.map(Joint::name).into_iter().zip(&set.joints) {
        writeln!(
            out,
            "\n[robust.{name}]\namplitude_deg = {:?}\noffset_deg = {:?}\nphase_deg = {:?}",
            joint.amplitude_deg, joint.offset_deg, joint.phase_deg
        )?;
    }
    Ok(())
}

fn write_thesis(out: &mut String, set: &ThesisSet) -> std::fmt::Result {
    writeln!(out, "\n[thesis.difference_per_s]")?;
    for (name, pair) in ["hips", "knees"].into_iter().zip(&set.difference_per_s) {
        writeln!(out, "{name} = {}", list(pair))?;
    }
    writeln!(out, "\n[thesis.product_per_deg_s]")?;
    for (name, pair) in ["left_leg", "right_leg"].into_iter().zip(&set.product_per_deg_s) {
        writeln!(out, "{name} = {}", list(pair))?;
    }
    for (name, joint) in Joint::ALL.map(Joint::name).into_iter().zip(&set.joints) {
        writeln!(
            out,
            "\n[thesis.{name}]\nalpha_per_s = {:?}\np_s2_per_deg2 = {:?}\nmu_rad_per_s = {:?}\noffset_deg = {:?}\nstart_phase_deg = {:?}",
            joint.alpha_per_s, joint.p_s2_per_deg2, joint.mu_rad_per_s, joint.offset_deg, joint.start_phase_deg
        )?;
    }
    Ok(())
}

fn write_shape(out: &mut String, kind: &str, first: &str, set: &ShapeSet) -> std::fmt::Result {
    writeln!(out, "\n[{kind}]\n{first}stride_s = {:?}", set.stride_s)?;
    for (name, joint) in Joint::ALL.map(Joint::name).into_iter().zip(&set.joints) {
        let (cos, sin) = (list(&joint.cos_deg), list(&joint.sin_deg));
        writeln!(out, "\n[{kind}.{name}]\nmean_deg = {:?}\ncos_deg = {cos}\nsin_deg = {sin}", joint.mean_deg)?;
    }
    Ok(())
}
