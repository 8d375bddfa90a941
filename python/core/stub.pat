# Patterns of nanobind's stubgen. Left to itself it would import from the package what the package has from here.
_core\.InputError$:
    class InputError(ValueError):
        \doc
