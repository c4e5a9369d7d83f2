//! The flash interface of an STM32F4 with its accelerator: stalls of instruction fetches and of data reads (RM0090 3.5.2).
//!
//! A read of flash gives a line of 128 bits, and takes one cycle more than there are wait states. The line that is read for instructions is
//! kept; the prefetch reads the line after it; 64 lines of instructions and 8 of data are cached, the one that was not used for the longest time
//! is replaced. A line goes into the cache of instructions when it was neither the present nor the prefetched one; whether a prefetched line that is
//! used goes there too is [`Prefetched`].
//!
//! Data are the words beside the code that an instruction names; constants that are read through a pointer are taken to cost no wait.
//!
//! Assumed, because the manual does not say it: the prefetch reads no line that is cached, begins when the flash is free, and runs to its end.

/// Bytes of a line.
pub const LINE: u32 = 16;
/// Lines of 1 MiB of flash.
const LINES: usize = 1 << 16;
/// Lines of the cache of instructions.
pub const INSTRUCTION_LINES: usize = 64;
/// Lines of the cache of data.
pub const DATA_LINES: usize = 8;

/// FLASH_ACR (RM0090 3.9.1).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Control {
    /// LATENCY: wait states.
    pub wait_states: u32,
    /// PRFTEN.
    pub prefetch: bool,
    /// ICEN.
    pub instruction_cache: bool,
    /// DCEN.
    pub data_cache: bool,
}

impl Control {
    /// The fields of the register's value.
    #[must_use]
    pub const fn of(value: u32) -> Self {
        Self {
            wait_states: value & 7,
            prefetch: value & 1 << 8 != 0,
            instruction_cache: value & 1 << 9 != 0,
            data_cache: value & 1 << 10 != 0,
        }
    }
}

/// What becomes of a prefetched line that is used: the manual can be read in both ways.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Prefetched {
    /// It is not cached: the manual says that a line is copied to the cache when it was not prefetched.
    #[default]
    NotCached,
    /// It is cached.
    Cached,
}

/// A cache that replaces the line that was not used for the longest time.
struct Cache {
    lines: Vec<u32>,
    used: Vec<u64>,
    /// For each line of flash its place, plus one.
    places: Vec<u8>,
    uses: u64,
    capacity: usize,
}

impl Cache {
    fn new(capacity: usize) -> Self {
        Self { lines: Vec::new(), used: Vec::new(), places: vec![0; LINES], uses: 0, capacity }
    }

    fn has(&self, line: u32) -> bool {
        self.places[line as usize % LINES] != 0
    }

    /// Notes a use of a line; true if it was there.
    fn use_line(&mut self, line: u32) -> bool {
        self.uses += 1;
        let place = self.places[line as usize % LINES];
        if place == 0 {
            return false;
        }
        self.used[usize::from(place) - 1] = self.uses;
        true
    }

    fn insert(&mut self, line: u32) {
        let place = if self.lines.len() < self.capacity {
            self.lines.push(line);
            self.used.push(0);
            self.lines.len() - 1
        } else {
            let oldest = self.used.iter().enumerate().min_by_key(|(_, used)| **used).map_or(0, |(place, _)| place);
            self.places[self.lines[oldest] as usize % LINES] = 0;
            self.lines[oldest] = line;
            oldest
        };
        self.used[place] = self.uses;
        self.places[line as usize % LINES] = place as u8 + 1;
    }

    fn clear(&mut self) {
        for line in self.lines.drain(..) {
            self.places[line as usize % LINES] = 0;
        }
        self.used.clear();
    }
}

/// The flash interface.
pub struct Flash {
    control: Control,
    assumed: Prefetched,
    instructions: Cache,
    data: Cache,
    present: Option<u32>,
    /// The prefetched line, and when it is there.
    prefetched: Option<(u32, u64)>,
    /// The flash reads up to then.
    busy_until: u64,
}

impl Flash {
    /// With empty caches.
    #[must_use]
    pub fn new(control: Control, assumed: Prefetched) -> Self {
        Self {
            control,
            assumed,
            instructions: Cache::new(INSTRUCTION_LINES),
            data: Cache::new(DATA_LINES),
            present: None,
            prefetched: None,
            busy_until: 0,
        }
    }

    /// Sets the register; both caches are empty then.
    pub fn set(&mut self, control: Control) {
        (self.control, self.present, self.prefetched) = (control, None, None);
        self.instructions.clear();
        self.data.clear();
    }

    /// Cycles that the core waits for the line with this number, which it begins to fetch in cycle `now`.
    pub fn fetch(&mut self, line: u32, now: u64) -> u64 {
        if self.present == Some(line) {
            return 0;
        }
        let prefetched = self.prefetched.filter(|(prefetched, _)| *prefetched == line);
        let stall = if let Some((_, ready)) = prefetched {
            self.prefetched = None;
            if self.control.instruction_cache && self.assumed == Prefetched::Cached {
                self.instructions.insert(line);
            }
            ready.saturating_sub(now)
        } else if self.control.instruction_cache && self.instructions.use_line(line) {
            0
        } else {
            let stall = self.read(now);
            if self.control.instruction_cache {
                self.instructions.insert(line);
            }
            stall
        };
        self.present = Some(line);
        let next = line + 1;
        let known = self.control.instruction_cache && self.instructions.has(next);
        if self.control.prefetch && !known && self.prefetched.is_none_or(|(line, _)| line != next) {
            let now = now + stall;
            let wait = self.read(now);
            self.prefetched = Some((next, now + wait));
        }
        stall
    }

    /// Cycles that the core waits for data in the line with this number, which it begins to read in cycle `now`.
    pub fn read_data(&mut self, line: u32, now: u64) -> u64 {
        if self.control.data_cache && self.data.use_line(line) {
            return 0;
        }
        let stall = self.read(now);
        if self.control.data_cache {
            self.data.insert(line);
        }
        stall
    }

    /// Reads a line as soon as the flash is free; returns the cycles from now on beyond the one of a read without wait states.
    fn read(&mut self, now: u64) -> u64 {
        let ready = now.max(self.busy_until) + u64::from(self.control.wait_states);
        self.busy_until = ready + 1;
        ready - now
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const ALL: Control = Control { wait_states: 5, prefetch: true, instruction_cache: true, data_cache: true };

    #[test]
    fn the_register_is_read() {
        assert_eq!(Control::of(0x705), ALL);
        assert_eq!(Control::of(0), Control::default());
    }

    #[test]
    fn without_accelerator_each_line_costs_the_wait_states() {
        let mut flash = Flash::new(Control { wait_states: 5, ..Control::default() }, Prefetched::NotCached);
        let stalls = [0, 1, 2, 1, 1].map(|line| flash.fetch(line, u64::from(line) * 100));
        assert_eq!(stalls, [5, 5, 5, 5, 0]);
    }

    #[test]
    fn a_line_in_the_cache_costs_nothing_and_the_oldest_of_65_is_replaced() {
        let mut flash = Flash::new(Control { prefetch: false, ..ALL }, Prefetched::NotCached);
        let mut now = 0;
        let mut fetch = |line| {
            now += 100;
            flash.fetch(line, now)
        };
        assert!((0..64).all(|line| fetch(2 * line) == 5));
        assert!((0..64).all(|line| fetch(2 * line) == 0));
        assert_eq!((fetch(500), fetch(2), fetch(0)), (5, 0, 5));
    }

    #[test]
    fn the_prefetch_hides_what_the_core_spends_in_a_line() {
        // RM0090: with 5 wait states a line of four 32-bit instructions runs in 4 cycles, and the next one needs 6.
        let mut flash = Flash::new(ALL, Prefetched::NotCached);
        assert_eq!(flash.fetch(10, 0), 5);
        // The prefetch begins at 6, and its line is there for a fetch at 11.
        assert_eq!(flash.fetch(11, 5 + 4), 2);
        let mut slower = Flash::new(ALL, Prefetched::NotCached);
        assert_eq!((slower.fetch(10, 0), slower.fetch(11, 5 + 8)), (5, 0));
        // A jump elsewhere waits for the prefetch that runs.
        let mut jumps = Flash::new(ALL, Prefetched::NotCached);
        assert_eq!((jumps.fetch(10, 0), jumps.fetch(40, 5 + 1)), (5, 6 + 5));
    }

    #[test]
    fn a_prefetched_line_is_cached_or_not_as_assumed() {
        let third = |assumed| {
            let mut flash = Flash::new(ALL, assumed);
            // Line 11 is prefetched; then a jump elsewhere and back to it.
            [(10, 0), (11, 100), (40, 200), (11, 300)].map(|(line, now)| flash.fetch(line, now))
        };
        assert_eq!(third(Prefetched::NotCached), [5, 0, 5, 5]);
        assert_eq!(third(Prefetched::Cached), [5, 0, 5, 0]);
    }

    #[test]
    fn data_have_eight_lines() {
        let mut flash = Flash::new(ALL, Prefetched::NotCached);
        let mut now = 0;
        let mut read = |line| {
            now += 100;
            flash.read_data(line, now)
        };
        assert!((0..8).all(|line| read(line) == 5));
        assert!((0..8).all(|line| read(line) == 0));
        assert_eq!((read(8), read(1), read(0)), (5, 0, 5));
    }
}
