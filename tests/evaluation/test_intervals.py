from math import comb

import pytest

from adaptbot_cli.evaluation.figures import bootstrap, mcnemar, wilson


@pytest.mark.parametrize(
    ("successes", "n", "low", "high"),
    # Newcombe (1998), table 1, to four digits
    [
        (81, 263, 0.2553, 0.3662),
        (15, 148, 0.0624, 0.1605),
        (0, 20, 0, 0.1611),
        (1, 29, 0.0061, 0.1718),
    ],
)
def test_wilson_as_published(successes: int, n: int, low: float, high: float) -> None:
    assert wilson(successes, n) == pytest.approx((low, high), abs=5e-5)


def test_bootstrap_holds_the_mean_and_is_the_same_each_time() -> None:
    values = [0, 0, 1, 1, 2, 5, 1, 0, 2, 3]
    low, high = bootstrap(values)
    assert low < sum(values) / len(values) < high
    assert bootstrap(values) == (low, high)


def test_bootstrap_is_about_what_the_normal_distribution_says() -> None:
    values = list(range(200))
    half = 1.96 * (200**2 / 12) ** 0.5 / 200**0.5
    assert bootstrap(values) == pytest.approx((99.5 - half, 99.5 + half), abs=1.5)


def test_equal_values_have_no_spread() -> None:
    assert bootstrap([2.0, 2.0, 2.0]) == (2.0, 2.0)


def test_mcnemar_is_a_two_sided_sign_test() -> None:
    assert mcnemar(0, 0) == 1
    assert mcnemar(3, 3) == 1
    assert mcnemar(1, 8) == mcnemar(8, 1) == pytest.approx(2 * (1 + comb(9, 1)) / 2**9)
