"""Command lines of headless Chromium, for tests and benchmarks."""

COMMON_FLAGS = (
    "--headless",
    "--no-sandbox",
    "--disable-background-networking",
    "--disable-component-update",
    "--disable-sync",
    "--no-first-run",
)

SOFTWARE_FLAGS = (*COMMON_FLAGS, "--use-angle=swiftshader", "--enable-unsafe-swiftshader")
"""WebGL is drawn in software, on every machine alike."""

GPU_FLAGS = (
    *COMMON_FLAGS,
    "--ignore-gpu-blocklist",
    "--enable-gpu",
    "--use-angle=vulkan",
    "--enable-features=Vulkan",
    "--disable-vulkan-surface",
)
"""WebGL is drawn by the GPU, through Vulkan."""
