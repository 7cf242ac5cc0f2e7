//! How often the ordered filter's maps are exact, on the environments and families of `evaluate`.
//!
//! `cargo run --release -p toposlam-eval --example ordered -- [PATHS] [ways|ways,travel] [CASE,...]`

use rand::seq::SliceRandom;
use std::path::Path;
use toposlam::{Filter as _, OrderedConfig, OrderedFilter};
use toposlam_eval::{
    environment::Environment,
    ordered::{Bearings, Building, WalkKind, WayHints, is_exact},
    parallel,
    walk::path_rng,
};

const LENGTHS: [usize; 4] = [25, 50, 100, 200];
const REFINEMENTS: usize = 10;
const SEED: u64 = 1;
const BEARINGS: Bearings = Bearings::Spread(0.5);

type Filter = OrderedFilter<10, 64, 192, 400>;

fn buildings(case: &str) -> anyhow::Result<Vec<Building>> {
    let load = |name: &str| {
        Environment::load(&Path::new(env!("CARGO_MANIFEST_DIR")).join(format!("environments/{name}.toml")))
    };
    let family = |text: &str, extra| -> anyhow::Result<Vec<Building>> {
        let family: toposlam_eval::family::Family = text.parse()?;
        (0..family.count).map(|index| Ok(Building::of_family(&family, index, BEARINGS, extra)?)).collect()
    };
    match case {
        "sd" | "variance" => (0..10)
            .map(|seed| Ok(Building::of_environment(load(&format!("wean-surrogate-{case}"))?, BEARINGS, seed)?))
            .collect(),
        "placements" => (0..20)
            .map(|seed| {
                let environment = load("wean-surrogate-sd")?;
                let mut labels: Vec<usize> = (0..environment.places().len()).collect();
                labels.shuffle(&mut path_rng(SEED, seed));
                Ok(Building::of_environment(environment.with_labels_of(&labels), BEARINGS, seed)?)
            })
            .collect(),
        "F1" => family("1,50,8,14,2-3,3-6,0.03-0.06,right-resolving", false),
        "F2" => family("1,50,14,24,2-3,3-6,0.03-0.06,right-resolving", false),
        "F4" => family("1,50,8,24,2-3,3-6,0.03-0.12,general", false),
        "multigraph" => family("1,50,8,24,2-3,3-6,0.03-0.12,general", true),
        other => anyhow::bail!("no case {other}"),
    }
}

fn main() -> anyhow::Result<()> {
    let mut arguments = std::env::args().skip(1);
    let paths = arguments.next().map_or(Ok(40), |paths| paths.parse())?;
    let travel = arguments.next().is_some_and(|hints| hints == "ways,travel").then_some(0.1);
    let cases = arguments.next().unwrap_or_else(|| "sd,placements,variance,F1,F2,F4,multigraph".into());
    let hints = WayHints { travel, ..WayHints::default() };
    println!("{hints:?}, {paths} paths, seed {SEED}, {} bytes", size_of::<Filter>());
    println!("| exact at T = | 25 | 50 | 100 | 200 |\n|---|---|---|---|---|");
    for case in cases.split(',') {
        let buildings = buildings(case)?;
        let exact = parallel::map(paths, 2, |path| {
            let building = &buildings[path % buildings.len()];
            let mut rng = path_rng(SEED, path as u64);
            let mut hint_rng = rng.clone();
            hint_rng.jump();
            let walk = building.draw_walk(200, WalkKind::Uniform, &mut rng);
            let reports = hints.draw(building, &walk, &mut rng, &mut hint_rng);
            let mut filter = Box::new(Filter::new());
            filter.start(OrderedConfig::DEFAULT, path as u64).map_err(|error| error.to_string())?;
            let mut exact = Vec::new();
            for (step, report) in reports.iter().enumerate() {
                if step > 0 {
                    (0..REFINEMENTS).for_each(|_| filter.refine());
                }
                filter.observe(*report);
                if LENGTHS.contains(&(step + 1)) {
                    let (map, path) = (filter.darts().expect("the filter has ways"), filter.path().collect::<Vec<_>>());
                    exact.push(is_exact(building, &walk[..=step], map, &path));
                }
            }
            Ok::<_, String>(exact)
        })?;
        let exact = exact.into_iter().collect::<Result<Vec<_>, _>>().map_err(anyhow::Error::msg)?;
        let share = |slot: usize| exact.iter().filter(|exact| exact[slot]).count() as f64 / paths as f64;
        let row: Vec<String> = (0..LENGTHS.len()).map(|slot| format!("{:.3}", share(slot))).collect();
        println!("| {case} | {} |", row.join(" | "));
    }
    Ok(())
}
