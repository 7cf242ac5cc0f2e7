//! The paper in f64: *Topological SLAM using Neighbourhood Information of Places* (Werner et al.), equation by equation.
//!
//! This is written to be read beside the paper, with plain collections and no care for speed. It shares no code with
//! the `toposlam` library, which is held to it by the tests of this package. Each definition and each equation is one
//! function, named in its documentation:
//!
//! | paper | here |
//! |---|---|
//! | Eq. 1, labelled graph | [`graph::Graph`], [`graph::Graph::label`] |
//! | Definition 3, n-gram | [`ngram::Ngram`] |
//! | Definition 4, `Grams_H` | [`ngram::grams_of_history`] |
//! | Definition 5, `Grams_G` | [`ngram::grams_of_graph`] |
//! | Definition 6, n-consistency | [`consistency::is_consistent`] |
//! | Eq. 2, Hausdorff distance | [`consistency::hausdorff`] |
//! | Eq. 3, maximum norm | [`consistency::distance`] |
//! | Eq. 4, normalised weights | [`filter::normalised_weights`] |
//! | III.A, prediction | [`filter::predict`] |
//! | Eq. 6, weight | [`filter::Candidate::ln_weight`] |
//! | Eq. 7, observation | [`filter::ln_observation_likelihood`] |
//! | Eq. 8, consistency | [`filter::ln_consistency_likelihood`] |
//! | Eq. 9, penalty | [`filter::ln_penalty`] |
//! | III.A, drawing N samples | [`filter::resample`] |
//! | III.B, localisation | [`filter::Particle::place`] |
//!
//! Labels and distances are in millimetres. Weights are natural logarithms, so that nothing underflows. Eq. 5 is Bayes'
//! theorem and has no function of its own.
//!
//! [`robust`] and [`ordered`] are not of the paper: they are the evidence by which the two filters of this project weigh hypotheses.
#![forbid(unsafe_code)]

pub mod consistency;
pub mod filter;
pub mod graph;
pub mod ngram;
pub mod ordered;
pub mod robust;
