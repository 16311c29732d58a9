"""The dashboard server of CB3 and e-Series controllers (text lines on TCP 29999) as a library. It knows no cell."""
