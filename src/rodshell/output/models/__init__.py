"""The shell in space for other programs: polylines, swept rods, time series. All in metres."""
