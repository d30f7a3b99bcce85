// SPDX-License-Identifier: Apache-2.0
// A sanitizer makes a loop over random cases some forty times as long; half of them finds what it is to find.
#pragma once

namespace gsc::test {

constexpr int casesOf(int n)
{
#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
    return (n + 1) / 2;
#else
    return n;
#endif
}

} // namespace gsc::test
