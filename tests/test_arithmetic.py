"""Nothing that a run tells comes from arithmetic that hangs on the machine; and what looks for it finds it."""

from __future__ import annotations

import pytest

from tests.arithmetic import found, offences


@pytest.mark.slow
def test_the_same_bits_everywhere() -> None:
    assert list(found()) == []


@pytest.mark.parametrize(
    ("source", "name"),
    [
        ("import math\nmath.exp(1.0)", "math.exp"),
        ("import math\nmap(math.log, x)", "math.log"),
        ("import math as m\nm.hypot(1.0, 2.0)", "math.hypot"),
        ("from math import sin as wave\n", "math.sin"),
        ("import cmath\n", "cmath"),
        ("import numpy as np\nnp.dot(a, b)", "numpy.dot"),
        ("import numpy as np\nnp.linalg.norm(a)", "numpy.linalg"),
        ("import numpy\nnumpy.sum(a)", "numpy.sum"),
        ("from numpy.linalg import inv\n", "numpy.linalg"),
        ("import numpy as np\nnp.random.default_rng(1)", "numpy.random.default_rng"),
        ("from scipy.stats import t\n", "scipy"),
        ("import scipy.linalg\n", "scipy"),
        ("x ** 2", "**"),
        ("x **= 2", "**"),
        ("2 ** x", "**"),
        ("2.0 ** 3", "**"),
        ("pow(x, 2)", "pow"),
        ("from operator import pow\n", "operator.pow"),
        ("a @ b", "@"),
        ("a @= b", "@"),
        ("sum(values)", "sum"),
        ("sum(x.size for x in values)", "sum"),
        ("sum(map(float, values))", "sum"),
        ("values.sum()", ".sum()"),
        ("(a - b).mean(axis=0)", ".mean()"),
        ("numba.njit(fastmath=True)", "fastmath"),
    ],
)
def test_what_hangs_on_the_machine_is_found(source: str, name: str) -> None:
    assert {each for _, each in offences(source)} == {name}


@pytest.mark.parametrize(
    "source",
    [
        "import math\nmath.sqrt(2.0) + math.fsum([0.1]) + math.prod([1.0]) + math.floor(1.5)",
        "import numpy as np\nnp.sqrt(a) + np.maximum(a, b) + np.abs(a)",
        "2 ** 63 - 10 ** 9",
        "sum(1 for x in values)",
        "sum(len(x) for x in values)",
        "sum(x > 1.0 for x in values)",
        "sum(map(len, values))",
        "self.mean.send(token.mean)",
        "import math\nmath.prod([1.0, 2.0])",
        "numba.njit(fastmath=False)",
    ],
)
def test_what_ieee_754_settles_is_not(source: str) -> None:
    assert list(offences(source)) == []
