//! The connection to an MQTT broker.

use std::sync::Arc;
use std::sync::mpsc::{Receiver, channel};
use std::thread;
use std::time::Duration;

use rumqttc::{Client, Connection, ConnectionError, LastWill, MqttOptions, Packet, QoS};

use super::{Broker, BrokerEvent, OFFLINE, Options, Outlet, QUEUE_MESSAGES, RETRY, Reports, Shared};

/// Keep-alive interval.
const KEEP_ALIVE: Duration = Duration::from_secs(5);
/// Maximum packet size; larger than any map as JSON.
const MOST_BYTES: usize = 1 << 17;

impl Outlet for Client {
    fn queue(&self, topic: &str, payload: Vec<u8>, is_retained: bool) -> bool {
        let quality = if is_retained { QoS::AtLeastOnce } else { QoS::AtMostOnce };
        self.try_publish(topic, quality, is_retained, payload).is_ok()
    }

    fn end(&self) -> bool {
        self.try_disconnect().is_ok()
    }
}

/// Starts the thread of the connection. It sends when it ends.
pub(super) fn start(
    options: Options,
    shared: Arc<Shared>,
    on_event: impl FnMut(BrokerEvent) + Send + 'static,
) -> (Box<dyn Outlet>, Receiver<()>) {
    let Broker { host, port, login, .. } = options.broker;
    // The client id is the robot's, so that a new publisher replaces one that hangs.
    let mut mqtt = MqttOptions::new(format!("toposlam-{}", options.robot), host, port);
    mqtt.set_keep_alive(KEEP_ALIVE).set_max_packet_size(MOST_BYTES, MOST_BYTES).set_last_will(LastWill::new(
        &shared.topics.status,
        OFFLINE,
        QoS::AtLeastOnce,
        true,
    ));
    if let Some((user, password)) = login {
        mqtt.set_credentials(user, password);
    }
    let (client, connection) = Client::new(mqtt, QUEUE_MESSAGES);
    let (sender, ended) = channel();
    let queue = client.clone();
    thread::spawn(move || {
        serve(connection, &queue, &shared, Reports::new(on_event));
        // The receiver may already be gone.
        let _ = sender.send(());
    });
    (Box::new(client), ended)
}

/// Maintains the connection until the publisher ends.
fn serve(mut connection: Connection, client: &Client, shared: &Shared, mut reports: Reports<impl FnMut(BrokerEvent)>) {
    for event in connection.iter() {
        match event {
            Ok(rumqttc::Event::Incoming(Packet::ConnAck(_))) => {
                shared.connected(client);
                reports.connected();
            }
            Ok(_) => {}
            Err(error) => {
                shared.disconnected();
                if shared.is_ending() || matches!(error, ConnectionError::RequestsDone) {
                    return;
                }
                reports.disconnected(error.to_string());
                thread::sleep(RETRY);
            }
        }
    }
}
