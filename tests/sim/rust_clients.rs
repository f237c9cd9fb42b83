//! Other people's crates, unmodified, on the simulated servos.

use std::path::Path;
use std::time::Duration;

use dynamixel2::Bus;
use dynamixel2::instructions::{BulkReadData, BulkWriteData, FactoryResetKind};
use rustypot::servo::dynamixel::xl430::Xl430Controller;
use rustypot::servo::feetech::sts3215::Sts3215Controller;

use crate::running::Sim;

const IDS: [u8; 4] = [1, 2, 3, 4];
/// Largest number of tries.
const TRIES: usize = 200;
/// Registers of the X series (e-manual): LED, Position P Gain.
const LED: u16 = 65;
const P_GAIN: u16 = 84;

/// A port as the crate serialport opens it, with a user's patience.
fn port(path: &Path, baud: u32) -> Box<dyn serialport::SerialPort> {
    serialport::new(path.to_str().unwrap(), baud).timeout(Duration::from_secs(60)).open().unwrap()
}

/// Repeats an action that may have failed because this machine was busy: dynamixel2 waits 34 ms for a servo, and
/// its user cannot change that.
fn patient<T, E: std::fmt::Debug>(mut of: impl FnMut() -> Result<T, E>) -> T {
    let mut last = None;
    for _ in 0..TRIES {
        match of() {
            Ok(done) => return done,
            Err(error) => last = Some(error),
        }
    }
    panic!("{last:?}");
}

#[test]
fn dynamixel2() {
    let sim = Sim::start("horse-dynamixel.toml", &[]);
    let mut bus = Bus::open(sim.port("left_hind"), 4_000_000).unwrap();
    for id in IDS {
        let ping = patient(|| bus.ping(id));
        assert_eq!((ping.motor_id, ping.alert, ping.data.model), (id, false, 1030));
    }
    let found = patient(|| {
        let found: Result<Vec<_>, _> = bus.scan().unwrap().into_iter().collect();
        found.map_err(|error| error.to_string()).and_then(|found| match found.len() {
            4 => Ok(found),
            count => Err(format!("{count} servos")),
        })
    });
    assert_eq!(found.iter().map(|of| of.motor_id).collect::<Vec<_>>(), IDS);

    patient(|| bus.write_u16(1, P_GAIN, 321));
    assert_eq!(patient(|| bus.read_u16(1, P_GAIN)).data, 321);
    bus.sync_write_u16(
        P_GAIN,
        IDS.map(|id| dynamixel2::instructions::SyncWriteData { motor_id: id, data: 400 + u16::from(id) }),
    )
    .unwrap();
    let read = patient(|| bus.sync_read_u16(&IDS, P_GAIN));
    assert_eq!(read.iter().map(|of| of.data).collect::<Vec<_>>(), [401, 402, 403, 404]);
    let writes = [
        BulkWriteData { motor_id: 1, address: P_GAIN, data: 500u16.to_le_bytes().to_vec() },
        BulkWriteData { motor_id: 2, address: LED, data: vec![1] },
    ];
    bus.bulk_write(&writes).unwrap();
    // Of one servo only: this version of the crate mixes up the places of several in its request.
    let read = patient(|| bus.bulk_read(&[BulkReadData { motor_id: 1, address: P_GAIN, count: 2 }]));
    assert_eq!(read[0].data, 500u16.to_le_bytes());
    assert_eq!(patient(|| bus.read_u8(2, LED)).data, 1);

    patient(|| bus.reg_write_u16(3, P_GAIN, 600));
    assert_eq!(patient(|| bus.read_u16(3, P_GAIN)).data, 403);
    bus.broadcast_action().unwrap();
    assert_eq!(patient(|| bus.read_u16(3, P_GAIN)).data, 600);
    patient(|| bus.reboot(3));
    assert_eq!(patient(|| bus.read_u16(3, P_GAIN)).data, 800, "as at every start");

    // Return delay, in the EEPROM.
    patient(|| bus.write_u8(4, 9, 7));
    patient(|| bus.factory_reset(4, FactoryResetKind::KeepIdAndBaudRate));
    assert_eq!(patient(|| bus.read_u8(4, 9)).data, 250);
}

#[test]
fn rustypot_on_dynamixel_servos() {
    let sim = Sim::start("horse-dynamixel.toml", &[]);
    // Its XL430 is the control table of the XM430, too.
    let mut servos =
        Xl430Controller::new().with_protocol_v2().with_serial_port(port(&sim.port("left_hind"), 4_000_000));
    assert!(IDS.iter().all(|&id| servos.ping(id).unwrap()));
    assert_eq!(servos.read_model_number(1).unwrap(), [1030]);
    servos.sync_write_position_p_gain(&IDS, &[410, 420, 430, 440]).unwrap();
    assert_eq!(servos.sync_read_position_p_gain(&IDS).unwrap(), [410, 420, 430, 440]);
    let mut servos = servos.with_fast_sync_read();
    assert_eq!(servos.sync_read_position_p_gain(&IDS).unwrap(), [410, 420, 430, 440]);

    // To the middle of the turn, at whatever torque and speed.
    servos.write_torque_enable(1, 1).unwrap();
    servos.write_goal_position(1, 2048).unwrap();
    while servos.read_present_position(1).unwrap()[0].abs_diff(2048) > 20 {}
    assert!(servos.reboot(1).unwrap());
    // It is silent for a while.
    servos.set_timeout(Duration::from_millis(100)).unwrap();
    assert_eq!(patient(|| servos.read_torque_enable(1)), [0]);
}

#[test]
fn rustypot_on_feetech_servos() {
    let sim = Sim::start("horse.toml", &[]);
    let mut servos =
        Sts3215Controller::new().with_protocol_v1().with_serial_port(port(&sim.port("main"), 1_000_000));
    assert!(IDS.iter().all(|&id| servos.ping(id).unwrap()));
    assert_eq!(servos.read_model_number(1).unwrap(), [777]);
    let voltages = servos.sync_read_present_voltage(&IDS).unwrap();
    assert!(voltages.iter().all(|deci_volts| (60..=130).contains(deci_volts)), "{voltages:?}");

    // Radians from the middle of the turn.
    let found = servos.sync_read_present_position(&IDS).unwrap();
    let goals: Vec<f64> = found.iter().map(|at| at - 0.3 * at.signum()).collect();
    servos.sync_write_goal_position(&IDS, &goals).unwrap();
    servos.sync_write_torque_enable(&IDS, &[true; 4]).unwrap();
    loop {
        let at = servos.sync_read_present_position(&IDS).unwrap();
        if at.iter().zip(&goals).all(|(at, goal)| (at - goal).abs() < 0.04) {
            break;
        }
    }
    servos.sync_write_torque_enable(&IDS, &[false; 4]).unwrap();
    assert_eq!(servos.sync_read_torque_enable(&IDS).unwrap(), [false; 4]);
}
