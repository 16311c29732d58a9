"""From the text of a mapping file to diagnostics and one immutable compiled plan."""
