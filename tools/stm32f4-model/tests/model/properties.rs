//! Property tests: agreement with a timer stepped clock by clock, independence of the lengths of advances, no change between events.

use proptest::prelude::*;
use stm32f4_model::{Conversion, Pin};

use crate::bench::*;
use crate::stepped_timer::SteppedTimer;

/// A write to TIM1, or an advance of time.
#[derive(Debug, Clone)]
enum Act {
    Pass(u64),
    Psc(u32),
    Arr(u32),
    Rcr(u32),
    Cnt(u32),
    Ccr(usize, u32),
    Modes(usize, u32, bool, u32, bool),
    Control(u32),
    Generate,
    ClearFlags(u32),
    Interrupts(u32),
}

fn act() -> impl Strategy<Value = Act> {
    prop_oneof![
        4 => (0u64..400).prop_map(Act::Pass),
        1 => (0u64..30_000).prop_map(Act::Pass),
        1 => (0u32..6).prop_map(Act::Psc),
        1 => (0u32..60).prop_map(Act::Arr),
        1 => (0u32..4).prop_map(Act::Rcr),
        1 => (0u32..70).prop_map(Act::Cnt),
        3 => (0usize..4, 0u32..65).prop_map(|(channel, value)| Act::Ccr(channel, value)),
        2 => (0usize..2, 0u32..8, any::<bool>(), 0u32..8, any::<bool>()).prop_map(|(w, a, p, b, q)| Act::Modes(w, a, p, b, q)),
        2 => (0u32..16, any::<bool>()).prop_map(|(low, arpe)| Act::Control(low | u32::from(arpe) << 7)),
        1 => Just(Act::Generate),
        1 => (0u32..32).prop_map(Act::ClearFlags),
        1 => (0u32..32).prop_map(Act::Interrupts),
    ]
}

const OUTPUTS: [&str; 4] = ["PA8", "PA9", "PA10", "PA11"];

/// TIM1 with all four channels on their pins, 16 MHz.
fn tim1(watched: bool) -> Bench {
    let mut bench = Bench::clocked();
    if watched {
        for name in OUTPUTS {
            bench.function(name, 2, 1);
        }
    }
    bench.set(TIM1 + CCER, 0x1111);
    bench.set(TIM1 + BDTR, 1 << 15);
    bench
}

/// Applies an act to the model.
fn perform(bench: &mut Bench, act: &Act, step: u64) {
    match *act {
        Act::Pass(cycles) => {
            let target = bench.soc.now() + cycles;
            while bench.soc.now() < target {
                bench.to((bench.soc.now() + step).min(target));
            }
        }
        Act::Psc(value) => bench.set(TIM1 + PSC, value),
        Act::Arr(value) => bench.set(TIM1 + ARR, value),
        Act::Rcr(value) => bench.set(TIM1 + RCR, value),
        Act::Cnt(value) => bench.set(TIM1 + CNT, value),
        Act::Ccr(channel, value) => bench.set(TIM1 + CCR1 + 4 * channel as u32, value),
        Act::Modes(which, a, p, b, q) => {
            let value = a << 4 | u32::from(p) << 3 | b << 12 | u32::from(q) << 11;
            bench.set(TIM1 + CCMR1 + 4 * which as u32, value);
        }
        Act::Control(value) => bench.set(TIM1 + CR1, value),
        Act::Generate => bench.set(TIM1 + EGR, 1),
        Act::ClearFlags(flags) => bench.set(TIM1 + SR, !flags),
        Act::Interrupts(enables) => bench.set(TIM1 + DIER, enables),
    }
}

fn perform_stepped(stepped: &mut SteppedTimer, act: &Act) {
    match *act {
        Act::Pass(cycles) => (0..cycles).for_each(|_| stepped.clock()),
        Act::Psc(value) => stepped.psc = value,
        Act::Arr(value) => stepped.arr = value,
        Act::Rcr(value) => stepped.rcr = value,
        Act::Cnt(value) => stepped.cnt = value,
        Act::Ccr(channel, value) => stepped.ccr[channel] = value,
        Act::Modes(which, a, p, b, q) => {
            (stepped.modes[2 * which], stepped.preload[2 * which]) = (a, p);
            (stepped.modes[2 * which + 1], stepped.preload[2 * which + 1]) = (b, q);
        }
        Act::Control(value) => {
            stepped.enabled = value & 1 != 0;
            stepped.udis = value & 2 != 0;
            stepped.urs = value & 4 != 0;
            stepped.opm = value & 8 != 0;
            stepped.arpe = value & 0x80 != 0;
        }
        Act::Generate => stepped.generate(),
        Act::ClearFlags(flags) => stepped.flags &= !flags,
        Act::Interrupts(_) => {}
    }
    if !matches!(act, Act::Pass(_)) {
        stepped.written();
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(200))]

    /// 17.3, 17.4: count, flags and reference levels equal those of the stepped timer, with used signals and without: a timer without
    /// used signals skips whole periods.
    #[test]
    fn agrees_with_a_timer_stepped_clock_by_clock(acts in prop::collection::vec(act(), 1..40), watched: bool) {
        let mut bench = tim1(watched);
        let mut stepped = SteppedTimer::new();
        for act in &acts {
            perform(&mut bench, act, u64::MAX / 2);
            perform_stepped(&mut stepped, act);
            prop_assert_eq!(bench.get(TIM1 + CNT), stepped.cnt, "count after {:?}", act);
            prop_assert_eq!(bench.get(TIM1 + SR), stepped.flags, "flags after {:?}", act);
            prop_assert_eq!(bench.get(TIM1 + CR1) & 1 != 0, stepped.enabled);
            if watched {
                let levels = OUTPUTS.map(|name| bench.soc.output_level(pin(name)));
                prop_assert_eq!(levels, stepped.reference, "levels after {:?}", act);
            }
        }
    }

    /// Edges come at the same clock as those of the stepped timer.
    #[test]
    fn edges_come_at_their_clock(acts in prop::collection::vec(act(), 1..20)) {
        let mut bench = tim1(true);
        bench.to(0);
        bench.plant.edges.clear();
        let mut stepped = SteppedTimer::new();
        let (mut wanted, mut now): (Vec<(Pin, bool, f64)>, u64) = (Vec::new(), 0);
        for act in &acts {
            let clocks = if let Act::Pass(cycles) = act { *cycles } else { 1 };
            for _ in 0..clocks {
                let before = stepped.reference;
                if let Act::Pass(_) = act {
                    stepped.clock();
                    now += 1;
                } else {
                    perform_stepped(&mut stepped, act);
                }
                for (channel, name) in OUTPUTS.iter().enumerate() {
                    if stepped.reference[channel] != before[channel] {
                        wanted.push((pin(name), stepped.reference[channel], now as f64 / 16e6));
                    }
                }
            }
            perform(&mut bench, act, u64::MAX / 2);
        }
        bench.pass(0);
        let mut got = bench.plant.edges.clone();
        // The order of edges within one cycle is not defined.
        got.sort_by(|a, b| a.2.total_cmp(&b.2).then(a.0.cmp(&b.0)));
        wanted.sort_by(|a, b| a.2.total_cmp(&b.2).then(a.0.cmp(&b.0)));
        prop_assert_eq!(got, wanted);
    }
}

/// The configuration of the board with odd periods: four servos, a timer-triggered injected group, a continuous regular group with DMA,
/// a time base, the watchdog, inputs. Its record must not depend on the lengths of the advances.
fn arrangement(periods: (u32, u32, u32), smp: u32) -> Bench {
    let mut bench = tim1(true);
    bench.plant.volts = Box::new(|channel, seconds| f64::from(channel.channel) * 0.2 + (seconds * 400.0).sin());
    bench.plant.inputs = (1..40).map(|n| (f64::from(n) * 13.7e-6, pin("PA0"), n % 2 == 1)).collect();
    bench.set(TIM1 + ARR, periods.0);
    for channel in 0..4 {
        bench.set(TIM1 + CCR1 + 4 * channel, periods.0 * (channel + 1) / 6);
    }
    bench.set(TIM1 + CCMR1, 0x6868);
    bench.set(TIM1 + CCMR2, 0x7868);
    bench.set(TIM1 + EGR, 1);
    bench.set(TIM1 + CR1, 0x81);
    bench.set(TIM2 + ARR, periods.1);
    bench.set(TIM2 + CR2, 2 << 4);
    bench.set(TIM2 + CR1, 1);
    bench.set(TIM5 + PSC, 3);
    bench.set(TIM5 + ARR, periods.2);
    bench.set(TIM5 + DIER, 3);
    bench.set(TIM5 + CCR1, periods.2 / 3);
    bench.set(TIM5 + EGR, 1);
    bench.set(TIM5 + CR1, 1);
    bench.set(EXTI, 1);
    bench.set(EXTI + 8, 1);
    bench.set(DMA2 + 0x14, 5);
    bench.set(DMA2 + 0x18, ADC1 + 0x4C);
    bench.set(DMA2 + 0x1C, 0x2000_0000);
    bench.set(DMA2 + 0x10, 1 << 13 | 1 << 11 | 1 << 10 | 1 << 8 | 1 << 4 | 1);
    bench.set(ADC1 + 0x10, smp | smp << 9);
    bench.set(ADC1 + 0x34, 3 | 4 << 5);
    bench.set(ADC1 + 0x2C, 1 << 20);
    bench.set(ADC1 + 0x38, 1 << 20 | 1 << 10 | 2 << 15);
    bench.set(ADC1 + 0x04, 1 << 8 | 1 << 7);
    bench.set(ADC1 + 0x08, 1 | 2 | 1 << 8 | 1 << 9 | 3 << 16 | 1 << 20 | 1 << 30);
    bench
}

type Record = (Vec<(Pin, bool, f64)>, Vec<Conversion>, Vec<(u32, f64)>, Vec<u8>, Vec<u32>);

fn record(bench: &mut Bench) -> Record {
    let registers =
        [TIM1 + CNT, TIM2 + CNT, TIM5 + SR, ADC1, ADC1 + 0x3C, DMA2, DMA2 + 0x14, EXTI + 0x14, GPIOA + 0x10];
    (
        std::mem::take(&mut bench.plant.edges),
        bench.soc.conversions().collect(),
        bench.plant.sampled.iter().map(|&(channel, at)| (u32::from(channel.channel), at)).collect(),
        bench.ram.0[..16].to_vec(),
        registers.iter().map(|&register| bench.get(register)).collect(),
    )
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(60))]

    /// One long advance and many short ones give the same record.
    #[test]
    fn history_does_not_depend_on_the_advances(
        periods in (50u32..3000, 300u32..3000, 20u32..900),
        smp in 0u32..8,
        steps in prop::collection::vec(1u64..700, 1..30),
    ) {
        let end = 12_000;
        let mut whole = arrangement(periods, smp);
        whole.to(end);
        let mut cut = arrangement(periods, smp);
        for step in steps.iter().cycle() {
            let target = (cut.soc.now() + step).min(end);
            cut.to(target);
            if target == end {
                break;
            }
        }
        prop_assert_eq!(record(&mut whole), record(&mut cut));
    }

    /// No visible change before the next event, and events come in order.
    #[test]
    fn nothing_changes_before_the_next_event(periods in (50u32..3000, 300u32..3000, 20u32..900), smp in 0u32..8) {
        let mut bench = arrangement(periods, smp);
        bench.to(0);
        while bench.soc.now() < 12_000 {
            let next = bench.soc.next_event().unwrap_or(u64::MAX);
            prop_assert!(next > bench.soc.now());
            let lines = *bench.soc.irq_lines();
            let edges = bench.plant.edges.len();
            bench.to(next - 1);
            prop_assert_eq!(&lines, bench.soc.irq_lines());
            prop_assert_eq!(edges, bench.plant.edges.len());
            bench.to(next);
            // As the handlers of a program: clear the flags, so that the lines can rise again.
            bench.set(TIM5 + SR, 0);
            bench.set(DMA2 + 8, 0x3D);
            bench.set(ADC1, !(1 << 2));
            bench.set(EXTI + 0x14, 1);
        }
    }

    /// Any address, width and value: no panic, and an access without effect makes a lint.
    #[test]
    fn any_access_is_answered(accesses in prop::collection::vec((any::<u32>(), 0usize..65, 0u32..0x400, any::<u32>(), 0u8..6), 1..60)) {
        let others = [0x4000_7000, 0xE004_2000, 0x1FFF_7A00];
        let blocks = [TIM1, TIM2, TIM6, ADC1, ADC_CCR, DMA2, GPIOA, GPIOB, EXTI, SYSCFG, RCC, FLASH_ACR];
        let bases = [&blocks[..], &others].concat();
        let mut bench = Bench::clocked();
        for (wild, which, offset, value, kind) in accesses {
            let addr = if which < bases.len() { bases[which] + offset } else { wild };
            let width = [stm32f4_model::Width::Byte, stm32f4_model::Width::Half, stm32f4_model::Width::Word][usize::from(kind % 3)];
            if kind < 3 {
                bench.soc.write(addr, width, value);
            } else {
                let read = bench.soc.read(addr, width);
                prop_assert!(read <= width.mask());
            }
            bench.pass(u64::from(value % 5000));
            let _ = bench.soc.take_reset();
        }
        for lint in bench.soc.lints() {
            prop_assert!(!lint.to_string().is_empty());
        }
    }
}
