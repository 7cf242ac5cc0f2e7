"""What a suite needs: where that is missing it fails in CI, and is skipped elsewhere, loudly."""

import os
import unittest


def require(missing: list[str], skipped: str) -> None:
    """To be called before the tests of a suite. `skipped` says what was not tried."""
    if missing:
        if os.environ.get("CI") == "true":
            raise RuntimeError(f"missing: {', '.join(missing)}")
        print(f"SKIPPED: {skipped}; missing: {', '.join(missing)}")
        raise unittest.SkipTest("something is missing")
