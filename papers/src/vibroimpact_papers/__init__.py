"""Published cases as checked, runnable entries."""
