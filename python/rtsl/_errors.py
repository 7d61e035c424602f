"""Exceptions, and the diagnostics that they carry."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import List, Optional, Sequence, Tuple


@dataclass(frozen=True)
class Diagnostic:
    """An error or a warning of the compiler.

    ``rtsl explain CODE`` of the command line explains a code. Lines and columns count from 1; they are ``None`` where
    a diagnostic has no place in a text.
    """

    code: str
    severity: str
    message: str
    file: Optional[str] = None
    line: Optional[int] = None
    column: Optional[int] = None
    end_line: Optional[int] = None
    end_column: Optional[int] = None
    notes: List[str] = field(default_factory=list)
    help: List[str] = field(default_factory=list)
    #: Edits that would fix the text: a message, and the new text.
    suggestions: List[Tuple[str, str]] = field(default_factory=list)

    def __str__(self) -> str:
        place = f"{self.file}:{self.line}:{self.column}: " if self.file is not None else ""
        return f"{place}{self.severity}[{self.code}]: {self.message}"


class Error(Exception):
    """The base of the exceptions of this package. Its text is what the command line prints."""

    #: What the compiler reported; empty for errors that it does not report.
    diagnostics: List[Diagnostic]

    def __init__(self, text: str, diagnostics: Sequence[Diagnostic] = ()) -> None:
        super().__init__(text)
        self.diagnostics = list(diagnostics)


class CompileError(Error):
    """A text with errors."""


class ParameterError(Error, ValueError):
    """Values that a class does not take."""


class SceneError(Error):
    """A scene that cannot be loaded or rendered."""


class ParameterWarning(UserWarning):
    """Values outside of the ranges that a class declares for its parameters. They are taken as they are."""


class SceneWarning(UserWarning):
    """What the renderer reports about a scene that it renders anyway."""


class InterpreterWarning(UserWarning):
    """There is no LLVM, so that methods run on the interpreter, slowly."""
