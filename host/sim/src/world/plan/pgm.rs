//! Images of grey pixels: PGM by a reader of its own, PNG by the crate `png`.

use super::PlanError;
use super::bitmap::CELLS_MAX;

/// Grey pixels, row by row, the northernmost first; 0 is black and 1 white.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Grey {
    pub(super) columns: usize,
    pub(super) pixels: Vec<f32>,
}

/// Reads a PNG or PGM image, by its first bytes.
pub(super) fn read(bytes: &[u8]) -> Result<Grey, PlanError> {
    match bytes {
        [0x89, b'P', b'N', b'G', ..] => png(bytes),
        [b'P', b'2' | b'5', ..] => pgm(bytes),
        _ => Err(PlanError::Magic),
    }
}

/// Checks the size before anything of that size is allocated.
fn pixels(columns: usize, rows: usize) -> Result<usize, PlanError> {
    let pixels = columns.saturating_mul(rows);
    if pixels > CELLS_MAX { Err(PlanError::TooLarge { columns, rows }) } else { Ok(pixels) }
}

/// Reads a plain (P2) or raw (P5) PGM image.
fn pgm(bytes: &[u8]) -> Result<Grey, PlanError> {
    let mut position = 2;
    let mut header = [0_usize; 3];
    let allowed = ["a width above 0", "a height above 0", "a maximum from 1 to 65535"];
    for (value, allowed) in header.iter_mut().zip(allowed) {
        let number = number(bytes, &mut position).filter(|number| *number > 0);
        *value = number.ok_or(PlanError::PgmHeader { allowed })?;
    }
    let [columns, rows, most] = header;
    if most > usize::from(u16::MAX) {
        return Err(PlanError::PgmHeader { allowed: allowed[2] });
    }
    let expected = pixels(columns, rows)?;
    let share = |value: usize| value.min(most) as f32 / most as f32;
    let pixels: Vec<f32> = if bytes[1] == b'2' {
        std::iter::from_fn(|| number(bytes, &mut position)).take(expected).map(share).collect()
    } else {
        // One character of white space ends the header.
        let raster = bytes.get(position + 1..).unwrap_or(&[]);
        let width = if most > 255 { 2 } else { 1 };
        let value = |pixel: &[u8]| pixel.iter().fold(0, |value, byte| value * 256 + usize::from(*byte));
        raster.chunks_exact(width).take(expected).map(value).map(share).collect()
    };
    match pixels.len() {
        found if found < expected => Err(PlanError::Truncated { expected, found }),
        _ => Ok(Grey { columns, pixels }),
    }
}

/// The next number after white space and comments.
fn number(bytes: &[u8], position: &mut usize) -> Option<usize> {
    loop {
        match bytes.get(*position)? {
            b'#' => *position += bytes[*position..].iter().position(|byte| *byte == b'\n')?,
            byte if byte.is_ascii_whitespace() => *position += 1,
            _ => break,
        }
    }
    let digits = bytes[*position..].iter().take_while(|byte| byte.is_ascii_digit()).count();
    let text = std::str::from_utf8(&bytes[*position..*position + digits]).ok()?;
    *position += digits;
    text.parse().ok()
}

/// Reads a PNG image; of colours the mean of red, green and blue counts, and transparency does not.
fn png(bytes: &[u8]) -> Result<Grey, PlanError> {
    let failed = |error: png::DecodingError| PlanError::Png(error.to_string());
    let mut decoder = png::Decoder::new(std::io::Cursor::new(bytes));
    decoder.set_transformations(png::Transformations::normalize_to_color8());
    let info = decoder.read_header_info().map_err(failed)?;
    let (columns, rows) = (info.width as usize, info.height as usize);
    let expected = pixels(columns, rows)?;
    let mut reader = decoder.read_info().map_err(failed)?;
    let mut buffer = vec![0; reader.output_buffer_size().unwrap_or(4 * expected)];
    let frame = reader.next_frame(&mut buffer).map_err(failed)?;
    let samples = frame.color_type.samples();
    let colours = if samples > 2 { 3 } else { 1 };
    let grey = |pixel: &[u8]| pixel[..colours].iter().map(|sample| f32::from(*sample)).sum::<f32>();
    let pixels = buffer[..frame.buffer_size()].chunks_exact(samples);
    Ok(Grey { columns, pixels: pixels.map(|pixel| grey(pixel) / (255.0 * colours as f32)).collect() })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn raw_and_plain_images_are_read_the_same() {
        let raw = read(b"P5\n# a comment\n3 2\n255\n\x00\x80\xff\xff\x80\x00").unwrap();
        let plain = read(b"P2 3 2 # a comment\n255 0 128 255 255 128 0").unwrap();
        assert_eq!(raw, plain);
        assert_eq!((raw.columns, raw.pixels[0], raw.pixels[2]), (3, 0.0, 1.0));
        let wide = read(b"P5 2 1 65535\n\x00\x00\xff\xff").unwrap();
        assert_eq!(wide.pixels, [0.0, 1.0]);
    }

    #[test]
    fn an_image_with_a_fault_is_refused() {
        assert_eq!(read(b"P6 1 1 255 000").unwrap_err(), PlanError::Magic);
        assert_eq!(read(b"").unwrap_err(), PlanError::Magic);
        let truncated = PlanError::Truncated { expected: 6, found: 4 };
        assert_eq!(read(b"P5 3 2 255\n\x00\x80\xff\xff").unwrap_err(), truncated);
        assert_eq!(read(b"P2 3 2 255\n1 2 3 4").unwrap_err(), truncated);
        for header in
            ["P5", "P5 x 2 255", "P5 0 2 255", "P5 3 -2 255", "P5 3 2 0", "P5 3 2 65536", "P5 99999999999999999999 2"]
        {
            assert!(matches!(read(header.as_bytes()), Err(PlanError::PgmHeader { .. })), "{header}");
        }
    }

    #[test]
    fn an_image_that_claims_to_be_huge_is_refused_before_it_is_read() {
        let huge = format!("P5 {} {} 255\n", usize::MAX / 2, 3);
        assert!(matches!(read(huge.as_bytes()), Err(PlanError::TooLarge { .. })));
        let mut claim = Vec::new();
        let mut encoder = png::Encoder::new(&mut claim, 100_000, 100_000);
        encoder.set_color(png::ColorType::Grayscale);
        drop(encoder.write_header().unwrap());
        assert!(matches!(read(&claim), Err(PlanError::TooLarge { .. })));
    }

    #[test]
    fn a_png_is_read_whatever_its_colours_and_a_broken_one_is_refused() {
        let encoded = |colour: png::ColorType, data: &[u8]| {
            let mut bytes = Vec::new();
            let mut encoder = png::Encoder::new(&mut bytes, 2, 1);
            encoder.set_color(colour);
            encoder.write_header().unwrap().write_image_data(data).unwrap();
            bytes
        };
        let grey = read(&encoded(png::ColorType::Grayscale, &[0, 255])).unwrap();
        assert_eq!(grey.pixels, [0.0, 1.0]);
        assert_eq!(read(&encoded(png::ColorType::GrayscaleAlpha, &[0, 9, 255, 9])).unwrap(), grey);
        assert_eq!(read(&encoded(png::ColorType::Rgb, &[0, 0, 0, 255, 255, 255])).unwrap(), grey);
        assert_eq!(read(&encoded(png::ColorType::Rgba, &[0, 0, 0, 9, 255, 255, 255, 9])).unwrap(), grey);
        let whole = encoded(png::ColorType::Grayscale, &[0, 255]);
        assert!(matches!(read(&whole[..whole.len() - 20]), Err(PlanError::Png(_))));
    }
}
