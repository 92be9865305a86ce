#pragma once

/// Marks what a shared library of Lumihull exports; everything else is hidden.
#define LUMIHULL_API __attribute__((visibility("default")))
