//! Address changes: each ends within its bounds of messages and waiting time.

use toposlam::ring::drivers::AddressError;

use super::fakes::{Answers, Budget, Counted, Waited};

pub(crate) fn address(
    from: u8,
    to: u8,
    answers: &[u8],
    messages: u32,
    is_address: impl Fn(u8) -> bool,
    change: impl FnOnce(&mut Counted<Answers<'_>>, &mut &Waited) -> Result<(), AddressError>,
) {
    let (budget, waited) = (Budget::new(u32::MAX), Waited::default());
    let mut bus = Counted { bus: Answers::new(answers, &budget), transactions: 0 };
    let changed = change(&mut bus, &mut &waited);
    assert_eq!(changed == Err(AddressError::From), !is_address(from));
    assert_eq!(changed == Err(AddressError::To), is_address(from) && !is_address(to));
    let most = match changed {
        Err(AddressError::From | AddressError::To) => 0,
        Err(AddressError::Taken) => 1,
        _ => 1 + messages + 20,
    };
    assert!(bus.transactions <= most, "{} transactions and {changed:?}", bus.transactions);
    assert!(waited.microseconds() <= 200_000);
}
