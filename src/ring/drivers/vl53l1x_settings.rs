//! The settings of a VL53L1X in registers 0x30 to 0x87: the default configuration of ST's ultra lite driver, STSW-IMG009.
//!
//! These values are from that driver, which has this licence:
//!
//! Copyright (c) 2017, STMicroelectronics. All rights reserved.
//!
//! Redistribution and use in source and binary forms, with or without modification, are permitted provided that the
//! following conditions are met:
//!
//! 1. Redistributions of source code must retain the above copyright notice, this list of conditions and the following
//!    disclaimer.
//! 2. Redistributions in binary form must reproduce the above copyright notice, this list of conditions and the following
//!    disclaimer in the documentation and/or other materials provided with the distribution.
//! 3. Neither the name of the copyright holder nor the names of its contributors may be used to endorse or promote products
//!    derived from this software without specific prior written permission.
//!
//! THIS SOFTWARE IS PROVIDED BY THE COPYRIGHT HOLDERS AND CONTRIBUTORS "AS IS" AND ANY EXPRESS OR IMPLIED WARRANTIES,
//! INCLUDING, BUT NOT LIMITED TO, THE IMPLIED WARRANTIES OF MERCHANTABILITY AND FITNESS FOR A PARTICULAR PURPOSE ARE
//! DISCLAIMED. IN NO EVENT SHALL THE COPYRIGHT HOLDER OR CONTRIBUTORS BE LIABLE FOR ANY DIRECT, INDIRECT, INCIDENTAL,
//! SPECIAL, EXEMPLARY, OR CONSEQUENTIAL DAMAGES (INCLUDING, BUT NOT LIMITED TO, PROCUREMENT OF SUBSTITUTE GOODS OR SERVICES;
//! LOSS OF USE, DATA, OR PROFITS; OR BUSINESS INTERRUPTION) HOWEVER CAUSED AND ON ANY THEORY OF LIABILITY, WHETHER IN
//! CONTRACT, STRICT LIABILITY, OR TORT (INCLUDING NEGLIGENCE OR OTHERWISE) ARISING IN ANY WAY OUT OF THE USE OF THIS
//! SOFTWARE, EVEN IF ADVISED OF THE POSSIBILITY OF SUCH DAMAGE.

/// Number of registers of one write: a message with the address of the register fits into any bus.
pub(super) const BLOCK_BYTES: usize = 8;
const FIRST_REGISTER: u16 = 0x30;

#[rustfmt::skip]
const SETTINGS: [[u8; BLOCK_BYTES]; 11] = [
    [0x01, 0x02, 0x00, 0x02, 0x08, 0x00, 0x08, 0x10],
    [0x01, 0x01, 0x00, 0x00, 0x00, 0x00, 0xFF, 0x00],
    [0x0F, 0x00, 0x00, 0x00, 0x00, 0x00, 0x20, 0x0B],
    [0x00, 0x00, 0x02, 0x0A, 0x21, 0x00, 0x00, 0x05],
    [0x00, 0x00, 0x00, 0x00, 0xC8, 0x00, 0x00, 0x38],
    [0xFF, 0x01, 0x00, 0x08, 0x00, 0x00, 0x01, 0xCC],
    [0x0F, 0x01, 0xF1, 0x0D, 0x01, 0x68, 0x00, 0x80],
    [0x08, 0xB8, 0x00, 0x00, 0x00, 0x00, 0x0F, 0x89],
    [0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x01],
    [0x0F, 0x0D, 0x0E, 0x0E, 0x00, 0x00, 0x02, 0xC7],
    [0xFF, 0x9B, 0x00, 0x00, 0x00, 0x01, 0x00, 0x00],
];

/// The blocks of the settings, each with its first register.
pub(super) fn blocks() -> impl Iterator<Item = (u16, [u8; BLOCK_BYTES])> {
    (FIRST_REGISTER..).step_by(BLOCK_BYTES).zip(SETTINGS)
}
