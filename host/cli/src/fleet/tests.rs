//! Fleets of simulated robots over TCP.

use super::replay_server::{AtEnd, Pace, RecordedStream, ReplayServer};
use super::*;
use std::io::Write;
use std::net::TcpListener;
use toposlam_sim::world::Plan;

const PATIENCE: Duration = Duration::from_millis(5);
const FRAME: Duration = Duration::from_millis(100);
const LIFE_FRAMES: usize = 6000;

fn streams() -> Vec<RecordedStream> {
    [("office", 1), ("ring", 2)]
        .map(|(plan, seed)| RecordedStream::record(&Plan::built_in(plan).unwrap(), seed, LIFE_FRAMES).unwrap())
        .into()
}

#[test]
fn a_closed_line_and_invalid_data_do_not_affect_other_robots() {
    const ROBOTS: usize = 20;
    let streams = streams();
    let maps: Vec<_> = streams.iter().map(|recorded| recorded.map().clone()).collect();
    assert!(maps.iter().all(|map| map.vertices.len() > 2));
    let mut server = ReplayServer::bind("127.0.0.1:0", streams, ROBOTS, AtEnd::Silence).unwrap();
    let others = TcpListener::bind("127.0.0.1:0").unwrap();
    let (robots_address, other_address) =
        (server.address().unwrap().to_string(), others.local_addr().unwrap().to_string());

    let mut fleet = Fleet::new().unwrap();
    for number in 0..ROBOTS {
        fleet.connect(&format!("robot {number}"), &robots_address);
    }
    let dying = fleet.connect("dying", &other_address);
    let (mut dying_end, _) = others.accept().unwrap();
    let nonsense = fleet.connect("nonsense", &other_address);
    let (mut nonsense_end, _) = others.accept().unwrap();
    nonsense_end.set_nonblocking(true).unwrap();
    drop(others);
    let absent = fleet.connect("absent", &other_address);

    dying_end.write_all(&[7, 1, 2]).unwrap();
    drop(dying_end);
    let garbage: Vec<u8> = (0..4096_u32).map(|byte| (byte * 37 % 11) as u8).collect();
    let (mut sent, mut messages) = (0, 0);
    loop {
        let piece = server.send(Duration::ZERO, Pace::Unbounded);
        sent += piece as u64;
        // Bytes that do not fit, because the fleet is behind, are not sent.
        let _ = nonsense_end.write(&garbage);
        fleet.listen(PATIENCE, |_, _, event| messages += u64::from(matches!(event, Event::Message(..)))).unwrap();
        let received: u64 = fleet.robots()[..ROBOTS].iter().map(Robot::bytes).sum();
        if server.accepted() == ROBOTS && piece == 0 && received == sent && fleet.totals().connecting == 0 {
            break;
        }
    }

    for (number, robot) in fleet.robots().iter().enumerate().take(ROBOTS) {
        assert_eq!((robot.name(), robot.end()), (format!("robot {number}").as_str(), None));
        assert!(robot.is_converged(), "{number}");
        assert_eq!(robot.listener().map(), maps[number % maps.len()], "{number}");
        assert_eq!(robot.listener().counters().lost, 0, "{number}");
        assert!(robot.places() > 0, "{number}");
    }
    assert_eq!(fleet.robots()[dying].end(), Some(End::Closed));
    assert_eq!(fleet.robots()[absent].end(), Some(End::Failed(ErrorKind::ConnectionRefused)));
    assert_eq!(fleet.robots()[nonsense].end(), None);
    let totals = fleet.totals();
    assert_eq!((totals.connected, totals.closed, totals.failed), (ROBOTS + 1, 1, 1));
    assert_eq!((totals.converged, totals.lost), (ROBOTS, 0));
    assert!(totals.damaged > 100, "{}", totals.damaged);
    assert_eq!(totals.messages, messages);
}

#[test]
fn a_restart_of_a_robot_does_not_count_as_lost_frames() {
    let recorded = RecordedStream::record(&Plan::built_in("flat").unwrap(), 1, 300).unwrap();
    let twice = 2 * recorded.bytes() as u64;
    let mut server = ReplayServer::bind("127.0.0.1:0", vec![recorded], 1, AtEnd::Restart).unwrap();
    let mut fleet = Fleet::new().unwrap();
    fleet.connect("restless", &server.address().unwrap().to_string());
    while fleet.totals().bytes <= twice {
        server.send(FRAME, Pace::Times(10.0));
        fleet.listen(PATIENCE, |_, _, _| ()).unwrap();
    }
    assert_eq!((fleet.totals().lost, fleet.totals().damaged), (0, 0));
}
