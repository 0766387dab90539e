"""Registration: from sparse observations to the organ as it is now, with an error bar.

A technique is a way in which the organ may move (`motion`); what was seen becomes scalar rows that pull at material
points (`seen`, `rows`), and one Gauss–Newton loop (`fitting`) brings both together.
"""
