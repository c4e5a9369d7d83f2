//! Counts the evaluations of a search, keeps the best point, and ends the search at a budget or a goal.
//!
//! A point whose cost is known, because the search had the same point before, counts as an evaluation without being computed again.
//!
//! All searches use the unit box; the caller's decoding gives the coordinates their meaning.

/// Progress of a search.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Progress {
    /// Points evaluated so far.
    pub evaluations: usize,
    /// Largest number of evaluations.
    pub budget: usize,
    /// Lowest cost so far.
    pub best: f64,
}

/// Evaluates costs of points in batches until a budget is used up or a goal is reached.
///
/// ```
/// use gait_fit::search::Evaluator;
/// let mut bowl = |points: &[Vec<f64>]| points.iter().map(|x| (x[0] - 0.25).powi(2)).collect();
/// let mut quiet = |_| ();
/// let mut evaluator = Evaluator::new(1, &mut bowl, &mut quiet).with_budget(3);
/// assert_eq!(evaluator.costs(&[vec![0.5], vec![0.25]]), [0.0625, 0.0]);
/// assert_eq!((evaluator.evaluations(), evaluator.best_cost(), evaluator.done()), (2, 0.0, true));
/// assert_eq!(evaluator.history(), [(1, 0.0625), (2, 0.0)]);
/// ```
pub struct Evaluator<'a> {
    dimensions: usize,
    of: &'a mut dyn FnMut(&[Vec<f64>]) -> Vec<f64>,
    progress: &'a mut dyn FnMut(Progress),
    budget: usize,
    goal: f64,
    evaluations: usize,
    computed: usize,
    best: Option<(Vec<f64>, f64)>,
    history: Vec<(usize, f64)>,
}

impl<'a> Evaluator<'a> {
    /// An evaluator with the cost function `of` for batches of points; NaN counts as +infinity.
    pub fn new(
        dimensions: usize,
        of: &'a mut dyn FnMut(&[Vec<f64>]) -> Vec<f64>,
        progress: &'a mut dyn FnMut(Progress),
    ) -> Self {
        let (budget, goal) = (usize::MAX, 0.0);
        Self { dimensions, of, progress, budget, goal, evaluations: 0, computed: 0, best: None, history: vec![] }
    }

    /// Ends the search after this many evaluations; a started batch is completed.
    #[must_use]
    pub fn with_budget(mut self, evaluations: usize) -> Self {
        self.budget = evaluations;
        self
    }

    /// Ends the search at this cost; a started batch is completed.
    #[must_use]
    pub fn with_goal(mut self, cost: f64) -> Self {
        self.goal = cost;
        self
    }

    /// Number of coordinates of a point.
    #[must_use]
    pub fn dimensions(&self) -> usize {
        self.dimensions
    }

    /// Evaluates a batch.
    pub fn costs(&mut self, points: &[Vec<f64>]) -> Vec<f64> {
        let costs = self.compute(points);
        self.note(points, &costs);
        costs
    }

    /// Evaluates a batch of which some costs are known, one place in `known` for each point: only the others are computed.
    ///
    /// ```
    /// use gait_fit::search::Evaluator;
    /// let mut bowl = |points: &[Vec<f64>]| points.iter().map(|x| (x[0] - 0.25).powi(2)).collect();
    /// let mut quiet = |_| ();
    /// let mut evaluator = Evaluator::new(1, &mut bowl, &mut quiet);
    /// assert_eq!(evaluator.costs_beside(&[vec![0.5], vec![0.25]], &[Some(0.0625), None]), [0.0625, 0.0]);
    /// assert_eq!((evaluator.evaluations(), evaluator.computed()), (2, 1));
    /// ```
    ///
    /// # Panics
    /// If `known` has another length than `points`.
    pub fn costs_beside(&mut self, points: &[Vec<f64>], known: &[Option<f64>]) -> Vec<f64> {
        assert_eq!(points.len(), known.len(), "a place for each point");
        let unknown: Vec<Vec<f64>> =
            points.iter().zip(known).filter(|(_, known)| known.is_none()).map(|(point, _)| point.clone()).collect();
        let mut computed = if unknown.is_empty() { vec![] } else { self.compute(&unknown) }.into_iter();
        let costs: Vec<f64> =
            known.iter().map(|known| known.or_else(|| computed.next()).expect("a cost for each point")).collect();
        self.note(points, &costs);
        costs
    }

    fn compute(&mut self, points: &[Vec<f64>]) -> Vec<f64> {
        self.computed += points.len();
        let mut costs = (self.of)(points);
        for cost in costs.iter_mut().filter(|cost| cost.is_nan()) {
            *cost = f64::INFINITY;
        }
        costs
    }

    /// Counts points whose costs were computed elsewhere, from residuals for instance.
    pub(crate) fn note(&mut self, points: &[Vec<f64>], costs: &[f64]) {
        for (point, &cost) in points.iter().zip(costs) {
            self.evaluations += 1;
            if cost < self.best_cost() {
                self.best = Some((point.clone(), cost));
                self.history.push((self.evaluations, cost));
            }
        }
        let now = Progress { evaluations: self.evaluations, budget: self.budget, best: self.best_cost() };
        (self.progress)(now);
    }

    /// Whether the budget is used up or the goal reached.
    #[must_use]
    pub fn done(&self) -> bool {
        self.evaluations >= self.budget || self.best_cost() <= self.goal
    }

    /// Points evaluated so far.
    #[must_use]
    pub fn evaluations(&self) -> usize {
        self.evaluations
    }

    /// Points whose cost the cost function computed: [`Self::evaluations`] without those whose cost was known, and without those of
    /// residuals.
    #[must_use]
    pub fn computed(&self) -> usize {
        self.computed
    }

    /// Lowest cost so far; +infinity before the first finite one.
    #[must_use]
    pub fn best_cost(&self) -> f64 {
        self.best.as_ref().map_or(f64::INFINITY, |(_, cost)| *cost)
    }

    /// The point of the lowest cost.
    #[must_use]
    pub fn best(&self) -> Option<&[f64]> {
        self.best.as_ref().map(|(point, _)| &point[..])
    }

    /// Evaluations at which the best cost improved, with that cost.
    #[must_use]
    pub fn history(&self) -> &[(usize, f64)] {
        &self.history
    }
}
