// SPDX-License-Identifier: Apache-2.0
#include "tests/backends/backend.h"

const gsc::test::Backend gsc::test::kBackend = {.name = "cuda",
                                                .judge = "cpu",
                                                .tiers = {Tier::Exact, Tier::Fast},
                                                .policies = {ReusePolicy::Depth},
                                                .exact_db = 90,
                                                .kept_db = 75,
                                                .other_depths = 1e-2,
                                                .table_bytes = 384u << 10,
                                                .makes_all = false,
                                                .frames = 4};
