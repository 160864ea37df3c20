"""The result of `drumstick accuracy` that the pages show: drumstick lab accuracy. In full; stores lab/results/accuracy.json."""

from drumstick_lab.accuracy.run import begun, fill
from drumstick_lab.measuring import stored


def main() -> None:
    """Measure all parts, and store them."""
    found = begun(quick=False)
    fill(found)
    stored.store("accuracy", found, **found["machine"])


if __name__ == "__main__":
    main()
