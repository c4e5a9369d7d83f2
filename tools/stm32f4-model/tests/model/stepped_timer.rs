//! Reference timer that is stepped clock by clock: RM0090 17.3 and 17.4 in the simplest form, for comparison with the model.

/// Registers as written and as active (17.3.1).
#[derive(Clone)]
pub(crate) struct SteppedTimer {
    pub(crate) cnt: u32,
    prescaled: u32,
    pub(crate) psc: u32,
    psc_shadow: u32,
    pub(crate) arr: u32,
    arr_shadow: u32,
    pub(crate) rcr: u32,
    rcr_shadow: u32,
    repetitions: u32,
    pub(crate) ccr: [u32; 4],
    ccr_shadow: [u32; 4],
    pub(crate) modes: [u32; 4],
    pub(crate) preload: [bool; 4],
    pub(crate) reference: [bool; 4],
    pub(crate) enabled: bool,
    pub(crate) arpe: bool,
    pub(crate) udis: bool,
    pub(crate) urs: bool,
    pub(crate) opm: bool,
    pub(crate) flags: u32,
}

impl SteppedTimer {
    pub(crate) fn new() -> Self {
        SteppedTimer {
            cnt: 0,
            prescaled: 0,
            psc: 0,
            psc_shadow: 0,
            arr: 0xFFFF,
            arr_shadow: 0xFFFF,
            rcr: 0,
            rcr_shadow: 0,
            repetitions: 0,
            ccr: [0; 4],
            ccr_shadow: [0; 4],
            modes: [0; 4],
            preload: [false; 4],
            reference: [false; 4],
            enabled: false,
            arpe: false,
            udis: false,
            urs: false,
            opm: false,
            flags: 0,
        }
    }

    /// Steps by one timer clock.
    pub(crate) fn clock(&mut self) {
        if !self.enabled || self.arr_shadow == 0 {
            return;
        }
        self.prescaled += 1;
        if self.prescaled <= self.psc_shadow {
            return;
        }
        self.prescaled = 0;
        let mut hits = [false; 4];
        if self.cnt == self.arr_shadow || self.cnt == 0xFFFF {
            hits = self.ccr_shadow.map(|ccr| ccr > self.arr_shadow);
            self.cnt = 0;
            self.overflow();
        } else {
            self.cnt += 1;
        }
        for (channel, hit) in hits.iter_mut().enumerate() {
            *hit |= self.cnt == self.ccr_shadow[channel];
            self.flags |= u32::from(*hit) << (channel + 1);
        }
        self.compare(hits);
    }

    fn overflow(&mut self) {
        if self.repetitions > 0 {
            self.repetitions -= 1;
            return;
        }
        self.repetitions = self.rcr_shadow;
        if !self.udis {
            self.update();
            self.flags |= 1;
            if self.opm {
                self.enabled = false;
            }
        }
    }

    fn update(&mut self) {
        self.psc_shadow = self.psc;
        self.arr_shadow = self.arr;
        self.rcr_shadow = self.rcr;
        self.repetitions = self.rcr;
        self.ccr_shadow = self.ccr;
    }

    fn compare(&mut self, hits: [bool; 4]) {
        for (channel, hit) in hits.into_iter().enumerate() {
            let below = self.cnt < self.ccr_shadow[channel];
            let reference = &mut self.reference[channel];
            match self.modes[channel] {
                1 if hit => *reference = true,
                2 if hit => *reference = false,
                3 if hit => *reference = !*reference,
                4 => *reference = false,
                5 => *reference = true,
                6 => *reference = below,
                7 => *reference = !below,
                _ => {}
            }
        }
    }

    /// Updates after a register write: registers without preload act at once, reference levels are updated.
    pub(crate) fn written(&mut self) {
        if !self.arpe {
            self.arr_shadow = self.arr;
        }
        for channel in 0..4 {
            if !self.preload[channel] {
                self.ccr_shadow[channel] = self.ccr[channel];
            }
        }
        self.compare([false; 4]);
    }

    /// EGR.UG.
    pub(crate) fn generate(&mut self) {
        self.cnt = 0;
        self.prescaled = 0;
        if !self.udis {
            self.update();
            if !self.urs {
                self.flags |= 1;
            }
            if self.opm {
                self.enabled = false;
            }
        }
        self.compare([false; 4]);
    }
}
