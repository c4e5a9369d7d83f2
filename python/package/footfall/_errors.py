"""The exceptions of footfall, and its warning."""


class FootfallError(Exception):
    """A correct input gave no result; the text says why, with values and units."""


class InputError(FootfallError, ValueError):
    """A value or the content of a file is wrong; the text says what, where and what is allowed, with units."""


class BoardError(FootfallError):
    """The virtual board ended, cannot go on or gave a pulse that no servo may get; the text says why, with times in s and widths in us."""

    def __init__(self, *text: object, log: bytes = b"") -> None:
        super().__init__(*text)
        self._log = log

    @property
    def log(self) -> bytes:
        """The last bytes of the log of a board that does not arm, at most 65536, as a debug probe reads them; else empty. No unit."""
        return self._log


class RecordingWarning(UserWarning):
    """A recording may not be what it seems; the text has the place in seconds and the angles in degrees."""
