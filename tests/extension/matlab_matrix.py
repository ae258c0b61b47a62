"""A matrix format from outside: the sparse matrices of a MATLAB file (.mat, up to version 7), by name."""

from collections.abc import Mapping
from pathlib import Path

import scipy.io
import scipy.sparse as sp

from fe.errors import MatrixFileError
from fe.file.matrix import MATRIX_FORMATS
from fe.file.matrix_content import FileMatrix, check_real_matrix
from fe.file.registry import FileFormat


def read(path: Path) -> Mapping[str, FileMatrix]:
    try:
        result = scipy.io.loadmat(path)
    except Exception as error:  # a dozen kinds, depending on which byte is damaged
        raise MatrixFileError(f'"{path}" is no MATLAB file up to version 7 ({error}): save it with -v7') from None
    return {name: check_real_matrix(path, value) for name, value in result.items() if sp.issparse(value)}


MATRIX_FORMATS.register(
    FileFormat(
        name="matlab",
        suffixes=(".mat",),
        recognise=lambda head: head.startswith(b"MATLAB 5.0"),
        read=read,
        write=None,
    )
)
