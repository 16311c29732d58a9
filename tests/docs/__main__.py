"""`python -m tests.docs`: make the generated parts of docs/ anew."""

from __future__ import annotations

from tests.docs.generated import ROOT, pages, renewed

for page in pages():
    before = page.read_text()
    after = renewed(before)
    if after != before:
        page.write_text(after)
        print(f"renewed {page.relative_to(ROOT)}")
