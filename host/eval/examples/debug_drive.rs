use toposlam::{OrderedConfig, OrderedFilter, FaultKind, Filter};
use toposlam::robot::RobotConfig;
use toposlam_sim::exploration::Exploration;
use toposlam_sim::world::{Plan, RobotModel};
fn main() {
    let args: Vec<String> = std::env::args().collect();
    let plan = Plan::built_in(&args[1]).unwrap();
    let noise: f64 = args[2].parse().unwrap();
    let seed: u64 = args[3].parse().unwrap();
    let places: usize = args[4].parse().unwrap();
    let verbose = args.len() > 5;
    let mut config: RobotConfig<16, OrderedConfig> = RobotConfig::new(toposlam::reference::RING, OrderedConfig::DEFAULT);
    config.mapper.filter.travel_noise_permille = 40;
    let mut e = Exploration::<64, OrderedFilter<10, 64, 192, 320>>::with_robot(&plan, RobotModel::default().with_noise(noise), seed, &config, &mut []).unwrap();
    let mut lost = 0; let mut state = e.robot().drive().state();
    let map = e.rover().true_map().clone();
    for (i, n) in map.nodes.iter().enumerate() { if verbose { println!("node {i} at {:.0},{:.0} r {:.0} ways {:?}", n.position.x_mm, n.position.y_mm, n.radius_mm, map.ways(i).iter().map(|w| { let ed=&map.edges[w.edge]; (ed.nodes[usize::from(!w.is_reversed)], (w.bearing_rad*57.3) as i32)}).collect::<Vec<_>>()); } }
    while e.places() < places {
        let seen = e.advance();
        if let Ok(t) = std::env::var("TRACE") { if e.places() == t.parse().unwrap() { 
            let det = e.robot().mapper().detector(); let sc = det.scan(); let ob = sc.obstacles(); let op = sc.openings(&ob);
            let v = e.robot().drive().state(); let h = e.rover().heading_mrad();
            println!("{v:?} heading {h} rot {} open {:?} obst {:?} entry {:?}", det.rotation_mrad(), op.bearings_mrad(), ob.equidistant().map(|o| (o.bearing_mrad, o.range_mm)).collect::<Vec<_>>(), e.robot().drive().passage().entry_mrad); } }
        let l = e.robot().drive().faults().count(FaultKind::DriveLost);
        if l != lost { lost = l; let p = e.rover().position(); let n = map.nearest_node(p).unwrap(); println!("LOST in {state:?} at {:.0},{:.0} nearest node {} {:.0} mm, after place {}", p.x_mm, p.y_mm, n.0, n.1, e.places()); }
        state = e.robot().drive().state();
        if seen.is_some() && verbose {
            let s = e.steps().last().unwrap();
            let f = e.robot().mapper().filter();
            let d = f.darts().unwrap();
            println!("{:3} node {:?} vertex {} ways {:?} pass {:?} | V {} E {} F {} arrival {:?} p {:.2} complete {} deg {:?}", e.places(), e.nodes().last().unwrap(), s.update.vertex, s.told.ways.map(|w| w.others().unwrap().to_vec()), s.told.passage, d.vertices().len(), d.edges().count(), d.frontiers().count(), f.arrival().map(|a| d.position(a)), f64::from(f.map_probability_q16())/65536.0, e.robot().drive().is_complete(), s.place.degree);
        }
    }
}
