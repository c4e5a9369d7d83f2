//! Both papers computed again: figures, tables, the searches for parameters, and every claim with its verdict.
//!
//! | module | content |
//! |---|---|
//! | [`figure`] | a figure as SVG and CSV |
//! | [`claim`] | a claim, its verdict, and claims as CSV and Markdown |
//! | [`settings`], [`study`] | how much is computed; the result |
//! | [`page`] | the result as one HTML page |
//! | `rayleigh`, `network` | the thesis' oscillators and its network |
//! | `problem` | what a search minimises |
//! | `searches`, `person` | its genetic algorithm and other searches; its network against a recorded stride |
//! | `block`, `literal`, `legs` | the building block and the hexapod of Yang et al. 2014; their equations as printed |
//! | `matsuoka` | Matsuoka's networks, on which both build |

mod block;
pub mod claim;
pub mod figure;
mod legs;
mod literal;
mod matsuoka;
mod network;
pub mod page;
mod person;
mod problem;
mod rayleigh;
mod searches;
pub mod settings;
pub mod study;

use gait_trace::Strides;

use figure::Figure;
use settings::Settings;
use study::{Section, Study};

/// The figures that no search is needed for.
///
/// # Errors
/// A generator cannot be built.
pub fn figures() -> Result<Vec<Figure>, String> {
    let mut figures = rayleigh::figures()?;
    figures.extend(network::figures()?);
    figures.extend(block::figures().map_err(|error| error.to_string())?);
    figures.extend(legs::figures().map_err(|error| error.to_string())?);
    figures.extend(matsuoka::run().0);
    Ok(figures)
}

/// Computes both papers. `strides` are those of a person; `progress` gets the name of each step.
///
/// # Errors
/// A generator cannot be built.
pub fn run(settings: &Settings, strides: &Strides, progress: &mut dyn FnMut(&str)) -> Result<Study, String> {
    let text = |error: &dyn std::fmt::Display| error.to_string();
    progress("single oscillators, figures 2.4 to 2.8");
    let (mut figures, mut claims) = (rayleigh::figures()?, rayleigh::claims()?);
    progress("the thesis' network, figures 5.1 to 5.6");
    figures.extend(network::figures()?);
    claims.extend(network::claims()?);
    let models = Section { title: "The thesis: oscillators and network", figures, tables: vec![] };
    let searches = searches::run(settings, progress);
    claims.extend(searches.claims);
    let (against_person, of_person) = person::run(settings, strides, progress);
    claims.extend(of_person);
    let figures = searches.figures.into_iter().chain([against_person]).collect();
    let searched = Section { title: "The thesis: the search for its parameters", figures, tables: searches.tables };
    progress("the building block and the hexapod of Yang et al. 2014");
    let mut figures = block::figures().map_err(|error| text(&error))?;
    figures.extend(legs::figures().map_err(|error| text(&error))?);
    claims.extend(block::claims().map_err(|error| text(&error))?);
    claims.extend(legs::claims().map_err(|error| text(&error))?);
    let table = block::table().map_err(|error| text(&error))?;
    let yang = Section { title: "Yang et al. 2014: building block and hexapod", figures, tables: vec![table] };
    progress("Matsuoka's networks");
    let (figures, table) = matsuoka::run();
    let matsuoka = Section { title: "On which both build: Matsuoka's networks", figures, tables: vec![table] };
    Ok(Study { sections: vec![models, searched, yang, matsuoka], claims })
}
