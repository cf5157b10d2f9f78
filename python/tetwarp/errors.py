# SPDX-FileCopyrightText: The Tetwarp authors
# SPDX-License-Identifier: Apache-2.0

"""What Tetwarp raises. Texts are those of the program: what, where, what to do."""


class Error(Exception):
    """Root of everything that Tetwarp raises."""


class InputError(Error, ValueError):
    """An input (a file, a series, a field, the shape of an array) cannot be used. Nothing was changed."""


class DeviceError(Error, RuntimeError):
    """A CUDA device failed: there is none, its memory is full, or a call returned an error."""


class NotCompiled(Error, RuntimeError):
    """This build does not contain the part of Tetwarp that was called; see `tetwarp.features`."""


class Cancelled(Error):
    """A stop was requested. Arrays of the call hold no usable result."""
