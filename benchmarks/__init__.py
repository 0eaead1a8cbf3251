"""Speed of vibroimpact beside other ways to simulate the impact damper; see README.md."""
