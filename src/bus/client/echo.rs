//! Drops the echo of what we send.

/// Separates the echo of a request from replies.
///
/// On a half-duplex line some adapters return what they send, before anything else. So bytes are held
/// back as long as they equal the request from its first byte on. If they equal all of it, they were
/// its echo; at the first difference there was no echo, and the bytes held back begin a reply.
#[derive(Debug, Default)]
pub(super) struct EchoFilter {
    held: usize,
    is_over: bool,
}

impl EchoFilter {
    /// Prepares for a new request.
    pub(super) fn restart(&mut self) {
        *self = EchoFilter::default();
    }

    /// Splits `received` and the bytes held back into what must be decoded: first the part of `request`
    /// held back so far, then the part of `received`.
    pub(super) fn pass<'a>(&mut self, request: &'a [u8], received: &'a [u8]) -> (&'a [u8], &'a [u8]) {
        if self.is_over {
            return (&[], received);
        }
        let held = request.get(..self.held).unwrap_or_default();
        let ahead = request.get(self.held..).unwrap_or_default();
        let equal = ahead.iter().zip(received).take_while(|(sent, heard)| sent == heard).count();
        if equal == ahead.len() {
            self.is_over = true;
            (&[], received.get(equal..).unwrap_or_default())
        } else if equal == received.len() {
            self.held += equal;
            (&[], &[])
        } else {
            self.is_over = true;
            (held, received)
        }
    }

    /// No more bytes will come: the bytes still held back were not a complete echo.
    pub(super) fn rest<'a>(&mut self, request: &'a [u8]) -> &'a [u8] {
        if self.is_over {
            return &[];
        }
        self.is_over = true;
        request.get(..self.held).unwrap_or_default()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn passed(request: &[u8], pieces: &[&[u8]]) -> Vec<u8> {
        let mut filter = EchoFilter::default();
        let mut out = Vec::new();
        for piece in pieces {
            let (held, rest) = filter.pass(request, piece);
            out.extend([held, rest].concat());
        }
        out.extend(filter.rest(request));
        out
    }

    #[test]
    fn an_echo_is_dropped_once_however_it_is_split() {
        let heard = [1, 2, 3, 1, 2, 3, 4];
        for split in 0..=heard.len() {
            let (first, second) = heard.split_at(split);
            assert_eq!(passed(&[1, 2, 3], &[first, second]), [1, 2, 3, 4]);
        }
    }

    #[test]
    fn bytes_that_only_begin_like_the_request_pass_unchanged() {
        let heard = [1, 2, 4, 5];
        for split in 0..=heard.len() {
            let (first, second) = heard.split_at(split);
            assert_eq!(passed(&[1, 2, 3], &[first, second]), heard);
        }
        assert_eq!(passed(&[1, 2, 3], &[&[1, 2]]), [1, 2]);
    }
}
