"""Tables as pages."""

from palpate.report.table_page import page


def test_text_stays_text_and_nothing_comes_from_elsewhere():
    table = "# T\n\n| E_pa | name |\n|---|---|\n| 1.5e+04 | a<b |\n"
    text = page(table + "\n<script>x</script>\n", title="t")
    assert "a&lt;b" in text
    assert "<script" not in text and "http" not in text
