//! From recorded strides to a generator's parameters: objectives, optimisers, judgement on strides that were not fitted, reports.
