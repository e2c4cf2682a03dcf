"""Tests how tools/price judges: python3 tests/price/price_test.py"""
import unittest

import price
from scenes import SCENES


def table(count):
    stored = price.Table("")
    stored.scenes["impulse"] = count, 50
    stored.packages = {"libc6": "2.36-9", "valgrind": "1:3.19.0-1"}
    return stored


class Price(unittest.TestCase):
    def test_calls_more_than_a_twentieth_more_an_error_that_names_the_next_step(self):
        text, is_error = table(1000).verdict("impulse", 1051)
        self.assertTrue(is_error)
        self.assertIn("5.1 % more", text)
        self.assertIn("tools/price --renew --only impulse", text)

    def test_lets_pass_what_lies_within_a_twentieth(self):
        for count in (951, 1000, 1049):
            self.assertEqual(table(1000).verdict("impulse", count), ("", False))

    def test_asks_for_a_new_table_without_failing_where_a_scene_takes_less(self):
        text, is_error = table(1000).verdict("impulse", 949)
        self.assertFalse(is_error)
        self.assertIn("--renew", text)

    def test_asks_for_a_row_of_a_new_scene(self):
        text, is_error = table(1000).verdict("report", 1)
        self.assertFalse(is_error)
        self.assertIn("tools/price --renew --only report", text)

    def test_reads_the_table_that_it_writes(self):
        again = price.Table(table(1234.5).text())
        self.assertEqual(again.scenes, {"impulse": (1234.5, 50)})
        self.assertEqual(again.packages, table(0).packages)

    def test_judges_only_with_the_packages_of_the_table(self):
        processor = "flags\t: fpu avx2 bmi1\n"
        here = table(0).packages
        self.assertEqual(price.not_judged_because(table(0), here, processor), "")
        self.assertIn("libc6 is 2.41", price.not_judged_because(table(0), here | {"libc6": "2.41"}, processor))
        self.assertIn("not installed", price.not_judged_because(table(0), {}, processor))
        self.assertIn("AVX2", price.not_judged_because(table(0), here, "flags\t: fpu avx\n"))

    def test_runs_where_valgrind_has_the_instructions_of_the_processor(self):
        self.assertEqual(price.not_run_because("flags\t: fpu rdtscp avx2\n"), "")
        self.assertIn("RDTSCP", price.not_run_because("flags\t: fpu avx2\n"))

    def test_has_a_committed_table_of_its_scenes_and_packages(self):
        committed = price.Table(price.TABLE.read_text())
        self.assertTrue(committed.scenes)
        self.assertLessEqual(set(committed.scenes), set(SCENES))
        self.assertEqual(sorted(committed.packages), sorted(price.PACKAGES))


if __name__ == "__main__":
    unittest.main()
