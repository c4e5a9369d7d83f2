//! A statement of a paper, and whether the program finds the same.

use serde::Serialize;

/// A paper.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Paper {
    /// "Designing CPG for Biped Locomotion Control using Nonlinear Dynamical Theory", IIITA Allahabad.
    Thesis,
    /// Yang et al. 2014, IOP Conf. Ser. Mater. Sci. Eng. 65 012008.
    Yang,
}

impl Paper {
    /// Its name in tables.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Thesis => "thesis",
            Self::Yang => "Yang et al. 2014",
        }
    }
}

/// The result for a claim.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Verdict {
    /// The program finds what the paper states.
    Reproduced,
    /// The program finds something else.
    NotReproduced,
    /// The paper does not state what is needed to decide.
    Undecided,
}

impl Verdict {
    /// The verdict in words.
    #[must_use]
    pub const fn words(self) -> &'static str {
        match self {
            Self::Reproduced => "reproduced",
            Self::NotReproduced => "not reproduced",
            Self::Undecided => "cannot be decided",
        }
    }

    /// Reproduced or not.
    #[must_use]
    pub const fn of(found: bool) -> Self {
        if found { Self::Reproduced } else { Self::NotReproduced }
    }
}

/// A claim. Its fields are those of `claims.json` and the columns of `claims.csv`.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct Claim {
    /// Its name, which stays the same between versions of the program.
    pub id: &'static str,
    /// The paper.
    pub paper: Paper,
    /// Where in the paper: figure, table, equation or section.
    pub place: &'static str,
    /// What the paper states, in our words.
    pub statement: String,
    /// The paper's number with its unit, or `not stated`.
    pub paper_number: String,
    /// The program's number with its unit.
    pub our_number: String,
    /// The result.
    pub verdict: Verdict,
    /// Why, in a sentence.
    pub why: String,
    /// The number, though not the verdict, depends on the budget of the searches, on the seed and on the processor.
    pub depends_on_budget: bool,
}

impl Claim {
    /// A claim whose number is the same in every run.
    #[must_use]
    pub fn new(paper: Paper, id: &'static str, place: &'static str, statement: &str, paper_number: &str) -> Self {
        Self {
            id,
            paper,
            place,
            statement: statement.into(),
            paper_number: paper_number.into(),
            our_number: String::new(),
            verdict: Verdict::Undecided,
            why: String::new(),
            depends_on_budget: false,
        }
    }

    /// With what the program finds.
    #[must_use]
    pub fn found(mut self, our_number: String, verdict: Verdict, why: &str) -> Self {
        (self.our_number, self.verdict, self.why) = (our_number, verdict, why.into());
        self
    }

    /// With a number that depends on the budget.
    #[must_use]
    pub fn by_search(mut self) -> Self {
        self.depends_on_budget = true;
        self
    }
}

/// The claims as CSV, one a row.
#[must_use]
pub fn to_csv(claims: &[Claim]) -> String {
    let mut rows = csv::Writer::from_writer(vec![]);
    for claim in claims {
        // Writing to a vector cannot fail.
        let _ = rows.serialize(claim);
    }
    rows.into_inner().ok().and_then(|bytes| String::from_utf8(bytes).ok()).unwrap_or_default()
}

/// The claims as a table of Markdown, as docs/reproduction.md has it but for the reasons.
#[must_use]
pub fn to_markdown(claims: &[Claim]) -> String {
    let mut table = String::from(
        "| claim | paper, place | what it states | paper's number | ours | verdict | why |\n|---|---|---|---|---|---|---|\n",
    );
    for claim in claims {
        let Claim { id, place, statement, paper_number, our_number, why, .. } = claim;
        let (paper, verdict) = (claim.paper.name(), claim.verdict.words());
        table += &format!(
            "| `{id}` | {paper}, {place} | {statement} | {paper_number} | {our_number} | **{verdict}** | {why} |\n"
        );
    }
    table
}
