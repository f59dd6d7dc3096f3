#!/usr/bin/env python3
"""Puts pictures of one size into rows: sheet.py SHEET.png COLUMNS PICTURE..."""
import sys

from PIL import Image

sheet, columns, pictures = sys.argv[1], int(sys.argv[2]), [Image.open(name) for name in sys.argv[3:]]
width, height = pictures[0].size
rows = -(-len(pictures) // columns)
whole = Image.new("RGB", (columns * width, rows * height))
for n, picture in enumerate(pictures):
    whole.paste(picture, (n % columns * width, n // columns * height))
whole.save(sheet, optimize=True)
