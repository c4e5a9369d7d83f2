//! Writes C3D files for tests: points alone, all three number formats, floats or scaled integers.
//!
//! Written from the format's description and apart from the reader, so that the two do not share a mistake.

/// Whose number format to write.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Format {
    Intel,
    Dec,
    Mips,
}

/// A file to be.
#[derive(Debug, Clone)]
pub(crate) struct C3d {
    pub(crate) format: Format,
    /// Factor of integers; `None` for floats.
    pub(crate) scale: Option<f32>,
    pub(crate) rate_hz: f32,
    /// Names and places; `None` where the point was not seen.
    pub(crate) points: Vec<(String, Vec<Option<[f32; 3]>>)>,
    /// Further text parameters: group, name, text.
    pub(crate) texts: Vec<(&'static str, &'static str, &'static str)>,
    /// Analog values in each frame, which a reader of points has to step over.
    pub(crate) analogs: u16,
}

impl Format {
    fn u16(self, value: u16) -> [u8; 2] {
        if self == Format::Mips { value.to_be_bytes() } else { value.to_le_bytes() }
    }

    fn f32(self, value: f32) -> [u8; 4] {
        match self {
            Format::Intel => value.to_le_bytes(),
            Format::Mips => value.to_be_bytes(),
            Format::Dec => {
                let [a, b, c, d] = (value * 4.0).to_le_bytes();
                [c, d, a, b]
            }
        }
    }
}

/// The chain of parameters.
struct Chain {
    format: Format,
    bytes: Vec<u8>,
}

impl Chain {
    fn record(&mut self, group: i8, name: &str, rest: &[u8]) {
        self.bytes.push(name.len() as u8);
        self.bytes.push(group as u8);
        self.bytes.extend(name.as_bytes());
        // The link counts from its own place; an empty description is one byte.
        self.bytes.extend(self.format.u16(2 + rest.len() as u16 + 1));
        self.bytes.extend(rest);
        self.bytes.push(0);
    }

    fn group(&mut self, id: i8, name: &str) {
        self.record(-id, name, &[]);
    }

    fn word(&mut self, group: i8, name: &str, value: u16) {
        let value = self.format.u16(value);
        self.record(group, name, &[2, 0, value[0], value[1]]);
    }

    fn long(&mut self, group: i8, name: &str, value: u32) {
        let words = [self.format.u16(value as u16), self.format.u16((value >> 16) as u16)].concat();
        self.record(group, name, &[vec![2, 1, 2], words].concat());
    }

    fn float(&mut self, group: i8, name: &str, value: f32) {
        let rest = [vec![4, 0], self.format.f32(value).to_vec()].concat();
        self.record(group, name, &rest);
    }

    fn texts(&mut self, group: i8, name: &str, texts: &[&str]) {
        let width = texts.iter().map(|text| text.len()).max().unwrap_or(0);
        let mut rest = vec![0xff, 2, width as u8, texts.len() as u8];
        for text in texts {
            rest.extend(format!("{text:width$}").bytes());
        }
        self.record(group, name, &rest);
    }
}

impl C3d {
    pub(crate) fn new(
        format: Format,
        scale: Option<f32>,
        rate_hz: f32,
        points: Vec<(String, Vec<Option<[f32; 3]>>)>,
    ) -> Self {
        Self { format, scale, rate_hz, points, texts: Vec::new(), analogs: 0 }
    }

    pub(crate) fn bytes(&self) -> Vec<u8> {
        let format = self.format;
        let all_frames = self.points[0].1.len();
        let frames = all_frames.min(65535) as u16;
        let count = self.points.len() as u16;
        let scale = self.scale.unwrap_or(-1.0);

        let mut chain = Chain { format, bytes: vec![1, 0x50, 0, [84, 85, 86][format as usize]] };
        chain.group(1, "POINT");
        chain.word(1, "USED", count);
        chain.float(1, "SCALE", scale);
        chain.float(1, "RATE", self.rate_hz);
        chain.word(1, "FRAMES", frames);
        for (n, names) in self.points.chunks(255).enumerate() {
            let names: Vec<&str> = names.iter().map(|(name, _)| name.as_str()).collect();
            let parameter = if n == 0 { "LABELS".to_owned() } else { format!("LABELS{}", n + 1) };
            chain.texts(1, &parameter, &names);
        }
        for &(group, name, text) in &self.texts {
            assert_eq!(group, "POINT");
            chain.texts(1, name, &[text]);
        }
        if all_frames > 65535 {
            chain.group(2, "TRIAL");
            chain.long(2, "ACTUAL_START_FIELD", 1);
            chain.long(2, "ACTUAL_END_FIELD", all_frames as u32);
        }
        // Space for DATA_START, whose value depends on the size of all of this, and for the end of the chain.
        let blocks = (chain.bytes.len() + 17 + 2).div_ceil(512);
        let data_block = 2 + blocks as u16;
        chain.word(1, "DATA_START", data_block);
        chain.bytes[2] = blocks as u8;
        chain.bytes.resize(blocks * 512, 0);

        let mut file = vec![0; 512];
        file[0] = 2;
        file[1] = 0x50;
        for (word, value) in
            [(1, count), (2, self.analogs), (3, 1), (4, frames), (8, data_block), (9, u16::from(self.analogs > 0))]
        {
            file[2 * word..2 * word + 2].copy_from_slice(&format.u16(value));
        }
        file[12..16].copy_from_slice(&format.f32(scale));
        file[20..24].copy_from_slice(&format.f32(self.rate_hz));
        file.extend(chain.bytes);
        for frame in 0..all_frames {
            for (_, places) in &self.points {
                let (place, residual) = places[frame].map_or(([0.0; 3], -1.0), |place| (place, 0.0));
                for value in place {
                    match self.scale {
                        Some(scale) => file.extend(format.u16((value / scale).round() as i16 as u16)),
                        None => file.extend(format.f32(value)),
                    }
                }
                match self.scale {
                    Some(_) => file.extend(format.u16(residual as i16 as u16)),
                    None => file.extend(format.f32(residual)),
                }
            }
            for n in 0..self.analogs {
                match self.scale {
                    Some(_) => file.extend(format.u16(n)),
                    None => file.extend(format.f32(f32::from(n))),
                }
            }
        }
        file.resize(file.len().div_ceil(512) * 512, 0);
        file
    }
}
