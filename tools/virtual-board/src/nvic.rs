//! NVIC and system exceptions of the Cortex-M4 with 82 interrupt lines: enable, pending, active and priority of each exception.
//!
//! Exceptions carry their architectural numbers: 2 NMI, 3 HardFault, 4 MemManage, 5 BusFault, 6 UsageFault, 11 SVCall, 14 PendSV,
//! 15 SysTick, 16 + n interrupt line n. A lower priority value is more urgent; Reset, NMI and HardFault have -3, -2 and -1.
//! State only, independent of the processor (ARMv7-M Architecture Reference Manual, B1.5 and B3.4).

/// Number of interrupt lines that are modelled: those of the STM32F407. The STM32F411 has some of them, and SPI4 and SPI5, the lines 84 and 85, which are
/// not modelled.
pub(crate) const LINES: u8 = 82;
/// Number of exceptions: 16 of the core, and the lines.
pub(crate) const EXCEPTIONS: usize = 16 + LINES as usize;
/// Implemented bits of a priority byte: the chips have the upper four.
const PRIORITY_MASK: u8 = 0xF0;
/// Execution priority with no exception active and no mask: less urgent than all.
const THREAD_PRIORITY: i16 = 256;

/// Non-maskable interrupt.
pub(crate) const NMI: u8 = 2;
/// HardFault.
pub(crate) const HARD_FAULT: u8 = 3;
/// MemManage fault.
pub(crate) const MEM_MANAGE: u8 = 4;
/// BusFault.
pub(crate) const BUS_FAULT: u8 = 5;
/// UsageFault.
pub(crate) const USAGE_FAULT: u8 = 6;
/// Supervisor call.
pub(crate) const SV_CALL: u8 = 11;
/// Debug monitor.
pub(crate) const DEBUG_MONITOR: u8 = 12;
/// PendSV.
pub(crate) const PEND_SV: u8 = 14;
/// SysTick.
pub(crate) const SYS_TICK: u8 = 15;

/// Values of the mask registers.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub(crate) struct Masks {
    /// PRIMASK: raises the execution priority to 0.
    pub(crate) primask: bool,
    /// FAULTMASK: raises the execution priority to -1.
    pub(crate) faultmask: bool,
    /// BASEPRI: raises the execution priority to this value; 0 masks nothing.
    pub(crate) basepri: u8,
}

/// State of the nested vectored interrupt controller and of the system exceptions.
#[derive(Debug, Clone)]
pub(crate) struct Nvic {
    enabled: u128,
    pending: u128,
    active: u128,
    lines: u128,
    priority: [u8; EXCEPTIONS],
    prigroup: u8,
    newly_pending: bool,
}

const fn bit(exception: u8) -> u128 {
    1 << exception
}

impl Default for Nvic {
    fn default() -> Self {
        Nvic {
            // The system exceptions that cannot be disabled.
            enabled: bit(NMI) | bit(HARD_FAULT) | bit(SV_CALL) | bit(PEND_SV) | bit(SYS_TICK),
            pending: 0,
            active: 0,
            lines: 0,
            priority: [0; EXCEPTIONS],
            prigroup: 0,
            newly_pending: false,
        }
    }
}

impl Nvic {
    /// True for an exception number of the chips: system exceptions and interrupt lines.
    #[must_use]
    pub(crate) const fn exists(exception: u8) -> bool {
        (exception as usize) < EXCEPTIONS && exception != 0
    }

    /// Enables an exception.
    pub(crate) fn enable(&mut self, exception: u8) {
        if Self::exists(exception) {
            self.enabled |= bit(exception);
        }
    }

    /// Disables an exception: if pending, it stays pending until it is enabled.
    pub(crate) fn disable(&mut self, exception: u8) {
        if Self::exists(exception) {
            self.enabled &= !bit(exception);
        }
    }

    /// True when the exception is enabled.
    #[must_use]
    pub(crate) fn is_enabled(&self, exception: u8) -> bool {
        Self::exists(exception) && self.enabled & bit(exception) != 0
    }

    /// The interrupt lines that are enabled, each with its priority, 0 to 15.
    pub(crate) fn enabled_lines(&self) -> impl Iterator<Item = (u8, u8)> {
        (0..LINES).filter(|line| self.is_enabled(16 + line)).map(|line| (line, self.priority(16 + line) >> 4))
    }

    /// Sets an exception pending.
    pub(crate) fn pend(&mut self, exception: u8) {
        if Self::exists(exception) {
            self.set_pending(bit(exception));
        }
    }

    fn set_pending(&mut self, which: u128) {
        self.newly_pending |= which & !self.pending != 0;
        self.pending |= which;
    }

    /// Clears the pending state. A line that is still high is pending again at once, unless it is active.
    pub(crate) fn unpend(&mut self, exception: u8) {
        if Self::exists(exception) {
            self.pending &= !bit(exception);
            self.latch_lines();
        }
    }

    /// True when the exception is pending.
    #[must_use]
    pub(crate) fn is_pending(&self, exception: u8) -> bool {
        Self::exists(exception) && self.pending & bit(exception) != 0
    }

    /// True while the exception's handler runs or is preempted.
    #[must_use]
    pub(crate) fn is_active(&self, exception: u8) -> bool {
        Self::exists(exception) && self.active & bit(exception) != 0
    }

    /// True when any interrupt line or system exception is pending, enabled or not.
    #[must_use]
    pub(crate) fn any_line_pending(&self) -> bool {
        self.pending >> 16 != 0
    }

    /// True once after an exception has become pending, which is an event with SEVONPEND.
    pub(crate) fn take_newly_pending(&mut self) -> bool {
        std::mem::take(&mut self.newly_pending)
    }

    /// Sets the levels of all interrupt lines; bit n of the 96 is line n. A line becomes pending when it rises, and again when its handler
    /// returns while the line is high.
    pub(crate) fn set_lines(&mut self, words: &[u32; 3]) {
        let lines = (u128::from(words[0]) | u128::from(words[1]) << 32 | u128::from(words[2]) << 64) << 16
            & ((1 << EXCEPTIONS) - 1);
        if lines == self.lines {
            return;
        }
        let risen = lines & !self.lines;
        self.lines = lines;
        self.set_pending(risen);
    }

    fn latch_lines(&mut self) {
        self.set_pending(self.lines & !self.active);
    }

    /// Sets the priority byte of an exception with configurable priority; the lower four bits are ignored.
    pub(crate) fn set_priority(&mut self, exception: u8, priority: u8) {
        if Self::exists(exception) && exception >= MEM_MANAGE {
            self.priority[usize::from(exception)] = priority & PRIORITY_MASK;
        }
    }

    /// The priority byte as it reads back.
    #[must_use]
    pub(crate) fn priority(&self, exception: u8) -> u8 {
        self.priority.get(usize::from(exception)).copied().unwrap_or(0)
    }

    /// Sets AIRCR.PRIGROUP, 0 to 7: priority bits above it decide preemption, the others only the order of pending exceptions.
    pub(crate) fn set_prigroup(&mut self, prigroup: u8) {
        self.prigroup = prigroup & 7;
    }

    /// AIRCR.PRIGROUP.
    #[must_use]
    pub(crate) const fn prigroup(&self) -> u8 {
        self.prigroup
    }

    fn group(&self, priority: u8) -> i16 {
        let below = (2u16 << self.prigroup) - 1;
        i16::from(priority & !(below as u8))
    }

    /// Preemption priority of an exception.
    #[must_use]
    pub(crate) fn group_priority(&self, exception: u8) -> i16 {
        match exception {
            NMI => -2,
            HARD_FAULT => -1,
            other => self.group(self.priority(other)),
        }
    }

    /// Preemption priority of the most urgent active exception, without the masks.
    fn active_priority(&self) -> i16 {
        bits(self.active).map(|n| self.group_priority(n)).min().unwrap_or(THREAD_PRIORITY)
    }

    /// Execution priority of the processor: a more urgent exception is taken.
    #[must_use]
    pub(crate) fn execution_priority(&self, masks: Masks) -> i16 {
        let mut priority = self.active_priority();
        if masks.basepri != 0 {
            priority = priority.min(self.group(masks.basepri));
        }
        if masks.primask {
            priority = priority.min(0);
        }
        if masks.faultmask {
            priority = priority.min(-1);
        }
        priority
    }

    /// Most urgent exception that is pending and enabled: by preemption priority, then subpriority, then number.
    #[must_use]
    pub(crate) fn best_pending(&self) -> Option<u8> {
        bits(self.pending & self.enabled).min_by_key(|&n| (self.group_priority(n), self.priority(n), n))
    }

    /// True if an exception is pending and enabled, masked or not.
    #[must_use]
    pub(crate) const fn has_pending(&self) -> bool {
        self.pending & self.enabled != 0
    }

    /// The exception to take now.
    #[must_use]
    pub(crate) fn deliverable(&self, masks: Masks) -> Option<u8> {
        if !self.has_pending() {
            return None;
        }
        self.best_pending().filter(|&n| self.group_priority(n) < self.execution_priority(masks))
    }

    /// True if an exception would be taken with no mask set; the caller must then read the mask registers.
    #[must_use]
    pub(crate) fn has_candidate(&self) -> bool {
        self.deliverable(Masks::default()).is_some()
    }

    /// Makes an exception active and no longer pending.
    pub(crate) fn activate(&mut self, exception: u8) {
        self.pending &= !bit(exception);
        self.active |= bit(exception);
    }

    /// Makes an exception inactive. A line that is still high is pending again.
    pub(crate) fn deactivate(&mut self, exception: u8) {
        self.active &= !bit(exception);
        self.latch_lines();
    }

    /// Makes every exception inactive, as AIRCR.VECTCLRACTIVE does.
    pub(crate) fn clear_active(&mut self) {
        self.active = 0;
        self.latch_lines();
    }

    /// Number of active exceptions.
    #[must_use]
    pub(crate) const fn active_count(&self) -> u32 {
        self.active.count_ones()
    }
}

fn bits(mut set: u128) -> impl Iterator<Item = u8> {
    std::iter::from_fn(move || {
        (set != 0).then(|| {
            let n = set.trailing_zeros() as u8;
            set &= set - 1;
            n
        })
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    const UNMASKED: Masks = Masks { primask: false, faultmask: false, basepri: 0 };

    fn ready(lines: &[(u8, u8)]) -> Nvic {
        let mut nvic = Nvic::default();
        for &(exception, priority) in lines {
            nvic.enable(exception);
            nvic.set_priority(exception, priority);
            nvic.pend(exception);
        }
        nvic
    }

    #[test]
    fn takes_the_lowest_priority_value_then_the_lowest_number() {
        assert_eq!(ready(&[(20, 0x80), (30, 0x40), (31, 0x40)]).deliverable(UNMASKED), Some(30));
        assert_eq!(ready(&[(20, 0x40), (30, 0x40)]).deliverable(UNMASKED), Some(20));
        assert_eq!(ready(&[]).deliverable(UNMASKED), None);
    }

    #[test]
    fn only_the_upper_four_priority_bits_exist() {
        let mut nvic = Nvic::default();
        nvic.set_priority(40, 0x5F);
        assert_eq!(nvic.priority(40), 0x50);
        let nvic = ready(&[(21, 0x4F), (20, 0x41)]);
        assert_eq!(nvic.deliverable(UNMASKED), Some(20), "equal after masking: the number decides");
    }

    #[test]
    fn enabled_lines_are_listed_without_the_exceptions_of_the_core() {
        let mut nvic = ready(&[(SYS_TICK, 0x10), (16, 0x40), (16 + 81, 0xF0)]);
        assert_eq!(nvic.enabled_lines().collect::<Vec<_>>(), [(0, 4), (81, 15)]);
        nvic.disable(16);
        assert_eq!(nvic.enabled_lines().collect::<Vec<_>>(), [(81, 15)]);
    }

    #[test]
    fn disabled_exceptions_stay_pending() {
        let mut nvic = ready(&[(20, 0x40)]);
        nvic.disable(20);
        assert_eq!(nvic.deliverable(UNMASKED), None);
        assert!(nvic.is_pending(20));
        nvic.enable(20);
        assert_eq!(nvic.deliverable(UNMASKED), Some(20));
    }

    #[test]
    fn preempts_only_when_strictly_more_urgent() {
        let mut nvic = ready(&[(20, 0x40)]);
        nvic.activate(20);
        for (priority, taken) in [(0x50, false), (0x40, false), (0x30, true)] {
            nvic.enable(21);
            nvic.set_priority(21, priority);
            nvic.pend(21);
            assert_eq!(nvic.deliverable(UNMASKED).is_some(), taken, "priority {priority:#x} over 0x40");
        }
        nvic.deactivate(20);
        nvic.set_priority(21, 0x50);
        assert_eq!(nvic.deliverable(UNMASKED), Some(21), "taken once the handler has ended");
    }

    #[test]
    fn prigroup_splits_preemption_from_order() {
        // PRIGROUP 5: bits 7 and 6 preempt, bits 5 and 4 order.
        let mut nvic = ready(&[(20, 0x40), (21, 0x70)]);
        nvic.set_prigroup(5);
        nvic.activate(21);
        assert_eq!(nvic.deliverable(UNMASKED), None, "same group: no preemption");
        nvic.deactivate(21);
        nvic.pend(21);
        assert_eq!(nvic.deliverable(UNMASKED), Some(20), "the subpriority decides the order");
    }

    #[test]
    fn masks_prevent_exceptions() {
        let nvic = ready(&[(20, 0x40)]);
        assert_eq!(nvic.deliverable(Masks { primask: true, ..UNMASKED }), None);
        assert_eq!(nvic.deliverable(Masks { basepri: 0x40, ..UNMASKED }), None);
        assert_eq!(nvic.deliverable(Masks { basepri: 0x50, ..UNMASKED }), Some(20));
        assert!(nvic.has_candidate());
        let mut nvic = nvic;
        nvic.pend(NMI);
        assert_eq!(nvic.deliverable(Masks { primask: true, ..UNMASKED }), Some(NMI));
        assert_eq!(nvic.deliverable(Masks { faultmask: true, ..UNMASKED }), Some(NMI));
        assert_eq!(nvic.execution_priority(Masks { faultmask: true, ..UNMASKED }), -1);
    }

    #[test]
    fn a_raised_line_is_pending_again_after_its_handler() {
        let mut nvic = Nvic::default();
        nvic.enable(16 + 28);
        nvic.set_lines(&[1 << 28, 0, 0]);
        assert_eq!(nvic.deliverable(UNMASKED), Some(44));
        nvic.activate(44);
        assert!(!nvic.is_pending(44));
        nvic.unpend(44);
        assert!(!nvic.is_pending(44), "an active line does not latch again");
        nvic.deactivate(44);
        assert!(nvic.is_pending(44), "the handler has not cleared its flag");
        nvic.activate(44);
        nvic.set_lines(&[0; 3]);
        nvic.deactivate(44);
        assert!(!nvic.is_pending(44));
    }

    #[test]
    fn a_line_that_falls_and_rises_during_its_handler_is_not_lost() {
        let mut nvic = Nvic::default();
        nvic.enable(16);
        nvic.set_lines(&[1, 0, 0]);
        nvic.activate(16);
        nvic.set_lines(&[0; 3]);
        nvic.set_lines(&[1, 0, 0]);
        nvic.set_lines(&[0; 3]);
        nvic.deactivate(16);
        assert!(nvic.is_pending(16));
    }

    #[test]
    fn lines_beyond_the_chip_are_ignored() {
        let mut nvic = Nvic::default();
        nvic.set_lines(&[0, 0, u32::MAX]);
        assert!(nvic.is_pending(16 + 81));
        assert!(!nvic.is_pending(16 + 82));
        nvic.enable(120);
        nvic.pend(120);
        assert_eq!(nvic.best_pending(), None);
    }

    #[test]
    fn newly_pending_is_reported_once() {
        let mut nvic = Nvic::default();
        nvic.pend(20);
        assert!(nvic.take_newly_pending());
        nvic.pend(20);
        assert!(!nvic.take_newly_pending());
    }
}
