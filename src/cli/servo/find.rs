//! Finds the servo that the user means: its protocol and rate.

use anyhow::Result;

use super::ServoArguments;
use crate::cli::BadInput;
use crate::cli::scan::wanted_protocols;
use crate::service::{Address, ServiceError, ServicePort, Servo, scan_bauds};
use crate::units::ServoId;

/// The one servo with the given id. Tries every rate and protocol that `which` leaves open.
///
/// # Errors
/// If no servo answers, or servos at several rates do.
pub(super) fn find<'p>(port: &'p mut ServicePort, which: &ServoArguments) -> Result<Servo<'p>> {
    let address = find_address(port, which)?;
    Ok(port.servo(address)?)
}

/// The same, or else the servo at `home`: it is there if an earlier move to `home` broke off.
pub(super) fn find_or_at<'p>(
    port: &'p mut ServicePort,
    which: &ServoArguments,
    home: Address,
) -> Result<Servo<'p>> {
    match find_address(port, which) {
        Ok(address) if port.is_anybody_at(address)? => Ok(port.servo(address)?),
        Err(error) if error.is::<BadInput>() => Err(error),
        Ok(_) | Err(_) => {
            say!(
                "no servo answers as id {}: using the servo at {home}, where it was when it was backed up",
                which.id
            );
            Ok(port.servo(home)?)
        }
    }
}

fn find_address(port: &mut ServicePort, which: &ServoArguments) -> Result<Address> {
    let candidates = candidates(which)?;
    if let [address] = candidates[..] {
        return Ok(address);
    }
    let mut found = Vec::new();
    // A second round if none answered in the first.
    for address in candidates.iter().chain(&candidates) {
        if *address == candidates[0] && !found.is_empty() {
            break;
        }
        match port.servo_at_once(*address) {
            Ok(_) | Err(ServiceError::Damaged { .. }) => found.push(*address),
            Err(ServiceError::NoAnswer { .. } | ServiceError::Baud { .. }) => {}
            Err(error) => return Err(error.into()),
        }
    }
    match found.as_slice() {
        [address] => Ok(*address),
        [] => Err(anyhow::anyhow!(
            "no servo answers as id {} on {}: check its power and cable; 'hippocamp scan {}' lists those that do",
            which.id,
            port.path().display(),
            port.path().display()
        )),
        several => {
            let several: Vec<String> = several.iter().map(Address::to_string).collect();
            Err(BadInput(format!(
                "several servos answer: {}; choose one with --baud and --protocol",
                several.join(", ")
            ))
            .into())
        }
    }
}

fn candidates(which: &ServoArguments) -> Result<Vec<Address>, BadInput> {
    let protocols = wanted_protocols(which.protocol);
    let bauds = protocols.iter().flat_map(|of| scan_bauds(*of).iter().map(move |baud| (*of, *baud)));
    let is_wanted = |baud: u32| which.baud.is_none_or(|wanted| wanted == baud);
    let wanted = bauds.filter(|(_, baud)| is_wanted(*baud));
    let all: Vec<Address> =
        wanted.map(|(protocol, baud)| Address { protocol, baud, id: ServoId(which.id) }).collect();
    match (all.is_empty(), which.baud) {
        (true, Some(baud)) => Err(BadInput(format!("--baud {baud}: no such servo has that rate"))),
        _ => Ok(all),
    }
}
