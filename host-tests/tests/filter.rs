//! The paper's filter: weights of the core within a stated tolerance of the reference's, and the same choice on the same
//! random draws.

mod common;

use common::drive::{Drive, Evidence, Random, Tally, VERTICES};
use common::fingerprint;
use toposlam::{Direction, FaultKind, Filter, PaperConfig, PaperFilter};

const DIRECTIONS: [Direction; 3] = [Direction::TwoSided, Direction::MapToHistory, Direction::HistoryToMap];

/// A random configuration with small n, so that the reference can enumerate.
fn config(random: &mut Random, direction: Direction) -> PaperConfig {
    // Beyond a σ_l of 113 mm the core interpolates Eq. 9, which is coarse for a φ near 1.
    let (largest_sigma_label_mm, penalties_permille) =
        if random.below(2) == 0 { (113, [0, 100, 300, 900, 999]) } else { (300, [0, 50, 100, 200, 300]) };
    PaperConfig::DEFAULT
        .with_ngram_length([2, 3, 3, 4, 5][random.below(5)])
        .with_particles(1 + random.below(10) as u8)
        .with_penalty_permille(penalties_permille[random.below(5)])
        .with_sigma_label_mm(10 + random.below(largest_sigma_label_mm - 9) as u16)
        .with_sigma_consistency_mm(10 + random.below(150) as u16)
        .with_direction(direction)
}

/// Drives both filters through random buildings: they agree at every place, and ties are rare.
fn agree(drives: u64, with_prior: bool) {
    let mut tally = Tally::default();
    for seed in 0..drives {
        let mut random = Random(seed);
        let config = config(&mut random, DIRECTIONS[seed as usize % 3]);
        let places = 2 + random.below(6);
        let building = random.building(places);
        let noise_steps = [0, 3, 15][random.below(3)];
        let evidence =
            if with_prior { Evidence::Prior(random.walk(&building, 30, noise_steps)) } else { Evidence::OnLine };
        let mut drive = Drive::new(config, &evidence);
        for observation_mm in random.walk(&building, 14, noise_steps) {
            drive.observe(observation_mm, &mut random);
        }
        tally.draws += drive.tally.draws;
        tally.ties += drive.tally.ties;
        tally.differing += drive.tally.differing;
    }
    println!("{tally:?}");
    assert!(tally.ties * 200 < tally.draws, "ties are rare: {tally:?}");
}

#[test]
fn the_filter_on_line_draws_the_same_particles_as_the_reference() {
    agree(300, false);
}

#[test]
fn the_filter_with_a_prior_draws_the_same_particles_as_the_reference() {
    agree(300, true);
}

#[test]
fn maps_at_saturated_distances_are_drawn_by_the_other_factors() {
    // Eq. 8 saturates at 64 σ_c, here at 64 to 256 mm: most maps are beyond.
    for seed in 0..150 {
        let mut random = Random(seed);
        let building = random.building(4);
        let config = PaperConfig::DEFAULT
            .with_ngram_length(3)
            .with_particles(10)
            .with_sigma_consistency_mm(1 + random.below(4) as u16)
            .with_sigma_label_mm(100)
            .with_direction(DIRECTIONS[seed as usize % 3]);
        let evidence =
            if random.below(2) == 0 { Evidence::OnLine } else { Evidence::Prior(random.walk(&building, 20, 15)) };
        let mut drive = Drive::new(config, &evidence);
        for observation_mm in random.walk(&building, 12, 15) {
            drive.observe(observation_mm, &mut random);
        }
    }
}

#[test]
fn with_an_empty_prior_the_other_factors_decide() {
    for (seed, direction) in (0..).zip(DIRECTIONS.into_iter().cycle().take(30)) {
        let mut random = Random(seed);
        let config = PaperConfig::DEFAULT.with_ngram_length(3).with_direction(direction);
        let mut drive = Drive::new(config, &Evidence::Prior(Vec::new()));
        let building = random.building(4);
        for observation_mm in random.walk(&building, 10, 5) {
            drive.observe(observation_mm, &mut random);
        }
    }
}

#[test]
fn long_n_grams_with_coarse_labels_agree() {
    for seed in 0..40 {
        let mut random = Random(seed);
        let config = PaperConfig::DEFAULT
            .with_ngram_length(6 + random.below(2) as u8)
            .with_particles(5)
            .with_direction(DIRECTIONS[seed as usize % 3]);
        let building = random.building(3);
        let evidence =
            if random.below(2) == 0 { Evidence::OnLine } else { Evidence::Prior(random.walk(&building, 8, 3)) };
        let mut drive = Drive::new(config, &evidence);
        for observation_mm in random.walk(&building, 8, 3) {
            drive.observe(observation_mm, &mut random);
        }
    }
}

#[test]
fn a_drive_longer_than_the_history_agrees_and_counts_the_dropped_observations() {
    for (seed, direction) in (0..).zip(DIRECTIONS) {
        let mut random = Random(seed);
        let mut drive =
            Drive::new(PaperConfig::DEFAULT.with_ngram_length(3).with_direction(direction), &Evidence::OnLine);
        let building = random.building(4);
        for observation_mm in random.walk(&building, 45, 3) {
            drive.observe(observation_mm, &mut random);
        }
        assert_eq!(drive.faults(FaultKind::HistoryFull), 45 - 32);
    }
}

#[test]
fn a_full_map_keeps_its_vertices_and_is_reported() {
    for (seed, direction) in (0..).zip(DIRECTIONS) {
        let mut random = Random(seed);
        let config = PaperConfig::DEFAULT
            .with_ngram_length(2)
            .with_penalty_permille(0)
            .with_sigma_label_mm(20)
            .with_direction(direction);
        let mut drive = Drive::new(config, &Evidence::OnLine);
        for place in 0..VERTICES + 4 {
            assert_eq!(drive.faults(FaultKind::VerticesFull), place.saturating_sub(VERTICES) as u32);
            drive.observe(1000.0 + 200.0 * place as f64, &mut random);
        }
        assert!(drive.sizes().iter().all(|&size| size == VERTICES));
    }
}

#[test]
fn a_map_of_one_vertex_has_the_penalty_one_minus_phi_because_eq_9_includes_a_equal_b() {
    for penalty_permille in [0_u16, 1, 100, 500, 999] {
        let mut filter = PaperFilter::<1, 4, 1>::new();
        filter.start(PaperConfig::DEFAULT.with_penalty_permille(penalty_permille).with_particles(1), 0).unwrap();
        filter.observe(fingerprint(1200.0));
        let phi = f64::from(penalty_permille) / 1000.0;
        let of_core = f64::from(filter.best().factors.ln_size_q16) / 65536.0;
        assert!((of_core - (1.0 - phi).ln()).abs() < 1e-4, "{of_core} {phi}");
    }
}

/// All updates of a filter on a drive of 40 places.
fn updates(filter: &mut PaperFilter<10, 16, 4>, seed: u64) -> Vec<String> {
    filter.start(PaperConfig::DEFAULT.with_ngram_length(4), seed).unwrap();
    let mut random = Random(7);
    let building = random.building(5);
    let mut observe = |observation_mm| {
        let update = filter.observe(fingerprint(observation_mm));
        format!("{update:?} {:?}", filter.particles())
    };
    random.walk(&building, 40, 15).into_iter().map(&mut observe).collect()
}

#[test]
fn the_same_seed_gives_the_same_drive_and_another_seed_another() {
    let mut filter = Box::new(PaperFilter::new());
    let first = updates(&mut filter, 1);
    assert_eq!(first, updates(&mut filter, 1), "a restarted filter has no state left");
    assert_eq!(first, updates(&mut Box::new(PaperFilter::new()), 1));
    assert_ne!(first, updates(&mut filter, 2));
}
