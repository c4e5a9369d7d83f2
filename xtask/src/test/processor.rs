//! Processor time of the programs that this one has run and waited for: it hardly depends on what else a machine does, as the clock's time does.

use std::time::Duration;

/// Ticks of a second in `/proc` (proc(5), `sysconf(_SC_CLK_TCK)`, which is 100 on every Linux).
const TICKS_S: u64 = 100;

/// The time so far; `None` where there is no `/proc`.
pub(super) fn time() -> Option<Duration> {
    of_children(&std::fs::read_to_string("/proc/self/stat").ok()?)
}

/// Fields 16 and 17 of proc(5): time of the children, in their code and in the kernel's. The name, field 2, may have blanks and parentheses.
fn of_children(stat: &str) -> Option<Duration> {
    let mut fields = stat.rsplit_once(')')?.1.split_whitespace().skip(13);
    let (own, kernel): (u64, u64) = (fields.next()?.parse().ok()?, fields.next()?.parse().ok()?);
    Some(Duration::from_millis((own + kernel) * 1000 / TICKS_S))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_fields_of_the_children_are_read() {
        let stat = "42 (a (b) c) S 1 42 42 0 -1 4194560 100 200 0 0 11 7 250 125 20 0 1 0 5";
        assert_eq!(of_children(stat), Some(Duration::from_millis(3750)));
        assert_eq!(of_children("42 (short) S 1"), None);
        assert_eq!(of_children(""), None);
    }

    #[cfg(target_os = "linux")]
    #[test]
    fn a_program_that_computes_takes_time() {
        let before = time().unwrap();
        let mut shell = crate::shell::command("sh");
        shell.args(["-c", "n=0; while [ $n -lt 300000 ]; do n=$((n+1)); done"]);
        assert!(shell.status().unwrap().success());
        assert!(time().unwrap() > before);
    }
}
