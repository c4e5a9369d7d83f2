//! The result as one HTML page: verdicts, claims, figures, tables. It needs no other file, network or script.

use std::fmt::Write as _;

use gait_fit::html::{self, csv_link, escape, percent_encoded};

use super::claim::{Claim, Verdict, to_csv};
use super::figure::Figure;
use super::study::{Section, Study, Table};

/// The page. `command` is the command line that makes it again, `seconds` are those of the wall clock and, if known, of the processor.
///
/// # Errors
/// The message of the drawing library.
pub fn page(study: &Study, command: &str, (wall_s, processor_s): (f64, Option<f64>)) -> Result<String, String> {
    let mut page = html::begin("the two papers, computed again", "The two papers, computed again");
    headline(&mut page, &study.claims);
    let processor = processor_s.map_or_else(String::new, |seconds| format!(", {seconds:.0} s of processor time"));
    // Writing to a String cannot fail.
    let _ = write!(page, "<h2>How it was computed</h2><pre>{}</pre>", escape(command));
    html::paragraph(
        &mut page,
        &format!(
            "{wall_s:.0} s by the clock{processor}; {}. The thesis: \"Designing CPG for Biped Locomotion Control using Nonlinear Dynamical Theory\", IIITA \
             Allahabad. Yang et al. 2014: IOP Conf. Ser. Mater. Sci. Eng. 65 012008. The figures show what the equations do; they are not copies of the papers' plots. Beside this page is each of them as SVG and as CSV.",
            concat!("footfall ", env!("CARGO_PKG_VERSION"))
        ),
    );
    claims(&mut page, &study.claims);
    for section in &study.sections {
        self::section(&mut page, section, command)?;
    }
    Ok(page + html::END)
}

fn headline(page: &mut String, claims: &[Claim]) {
    let count = |verdict| claims.iter().filter(|claim| claim.verdict == verdict).count();
    let _ = write!(
        page,
        "<section class=\"headline\"><h2>Of {} claims</h2><p class=\"number\">{} reproduced, {} not, {} undecided</p>",
        claims.len(),
        count(Verdict::Reproduced),
        count(Verdict::NotReproduced),
        count(Verdict::Undecided)
    );
    html::paragraph(
        page,
        "A claim is undecided if the paper does not state what is needed to decide it. Each has its reason in the table.",
    );
    *page += "</section>";
}

fn claims(page: &mut String, claims: &[Claim]) {
    *page += "<section class=\"claims\"><h2>The claims</h2>";
    html::table(
        page,
        "Claims of the papers, with the paper's number and ours",
        &["what the paper states", "where", "the paper's number", "ours", "verdict", "why"],
        claims.iter().map(|claim| {
            let place = format!("{}, {}", claim.paper.name(), claim.place);
            let Claim { statement, paper_number, our_number, verdict, why, .. } = claim;
            [
                statement.clone(),
                place,
                paper_number.clone(),
                our_number.clone(),
                verdict.words().to_owned(),
                why.clone(),
            ]
        }),
    );
    let _ = write!(
        page,
        "<p class=\"screen\">{}</p></section>",
        csv_link("claims.csv", "The claims as CSV", &to_csv(claims))
    );
}

fn section(page: &mut String, section: &Section, command: &str) -> Result<(), String> {
    let _ = write!(page, "<section><h2>{}</h2>", escape(section.title));
    section.tables.iter().for_each(|table| self::table(page, table));
    section.figures.iter().try_for_each(|figure| self::figure(page, figure, command))?;
    *page += "</section>";
    Ok(())
}

fn table(page: &mut String, table: &Table) {
    let head: Vec<&str> = table.head.iter().map(String::as_str).collect();
    html::table(page, &table.title, &head, table.rows.iter().map(|row| row.iter().map(String::as_str)));
    html::paragraph(page, &table.note);
    let _ = write!(
        page,
        "<p class=\"screen\">{}</p>",
        csv_link(&format!("{}.csv", table.name), "This table as CSV", &table.csv())
    );
}

/// A figure as an image that the page holds: the colours of the page do not reach into it.
fn figure(page: &mut String, figure: &Figure, command: &str) -> Result<(), String> {
    let Figure { name, title, shows, .. } = figure;
    let _ = write!(
        page,
        "<figure id=\"{name}\"><h3>{}</h3><p>{}</p><img alt=\"{}\" src=\"data:image/svg+xml,{}\"/>",
        escape(title),
        escape(shows),
        escape(&format!("{title}. {shows}")),
        percent_encoded(&figure.svg(command)?)
    );
    let _ = write!(page, "<p class=\"quiet\">{name}.svg and {name}.csv are beside this page.</p></figure>");
    Ok(())
}
