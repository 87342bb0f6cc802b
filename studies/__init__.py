"""Programs that measure this package and write pages of docs/. They need its source tree and are not installed."""
