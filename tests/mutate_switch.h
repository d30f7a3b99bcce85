// SPDX-License-Identifier: Apache-2.0
#pragma once
// Switches that mutate.py writes into the sources of a clone: every change is there from one build on, and GSC_MUTANT
// names the one that is in force. A byte for each change tells what a program saw of it, in the file named by
// GSC_MUTANTS_SEEN.
#include <concepts>
#include <cstddef>
#include <cstdlib>
#include <fcntl.h>
#include <initializer_list>
#include <sys/mman.h>
#include <type_traits>
#include <unistd.h>

namespace gsc_mutant {
constexpr int kMost = 1 << 14;
enum : unsigned char {
    kReached = 1,
    kCannotBe = 2, // the changed form does not compile for these types
    kDiffers = 3,  // reached with operands that make a difference
};
inline unsigned char not_kept[kMost];
inline unsigned char* seen = not_kept;
inline int active = -1;

[[gnu::constructor(101), gnu::used]] static void open_switch()
{
    if (seen != not_kept || active >= 0)
        return;
    if (const char* name = std::getenv("GSC_MUTANT"))
        active = std::atoi(name);
    if (const char* path = std::getenv("GSC_MUTANTS_SEEN")) {
        const int file = ::open(path, O_RDWR | O_CLOEXEC);
        void* bytes = ::mmap(nullptr, kMost, PROT_READ | PROT_WRITE, MAP_SHARED, file, 0);
        if (bytes != MAP_FAILED)
            seen = static_cast<unsigned char*>(bytes);
        ::close(file);
    }
}

// Constant expressions keep what is written.
template <class T>
constexpr T pick(int id, const T& written, const T& changed, bool differs)
{
    if (std::is_constant_evaluated())
        return written;
    if (seen[id] < kDiffers)
        seen[id] = differs ? kDiffers : kReached;
    return active == id ? changed : written;
}

constexpr bool pick(int id, bool written, bool changed)
{
    return pick<bool>(id, written, changed, written != changed);
}

inline bool isOn(int id)
{
    seen[id] = kDiffers;
    return active == id;
}

inline void cannotBe(int id)
{
    seen[id] = kCannotBe;
}

template <class T>
constexpr T number(int id, T written, T changed)
{
    return pick<T>(id, written, changed, true);
}

template <class T>
constexpr T constant(int id, const T& written)
{
    if constexpr (std::integral<T> && !std::same_as<T, bool>)
        return pick<T>(id, written, static_cast<T>(written + 1), true);
    else if constexpr (std::floating_point<T>)
        return pick<T>(id, written, written * T(1.25), true);
    else if constexpr (std::is_enum_v<T>) // flags: the next one
        return pick<T>(id, written, static_cast<T>(int(written) != 0 ? int(written) * 2 : 1), true);
    else if (!std::is_constant_evaluated())
        cannotBe(id);
    return written;
}

template <class T, std::size_t N>
constexpr const T (&constant(int id, const T (&written)[N]))[N]
{
    if (!std::is_constant_evaluated())
        cannotBe(id);
    return written;
}

constexpr bool drop(int id, bool condition)
{
    return pick(id, condition, false);
}

// "a < b" is written "a < Lt{7} < b", which binds as before
#define GSC_MUTANT_COMPARISON(Name, op, other)                                                                         \
    struct Name {                                                                                                      \
        int id;                                                                                                        \
    };                                                                                                                 \
    template <class A>                                                                                                 \
    struct Name##Left {                                                                                                \
        const A& value;                                                                                                \
        int id;                                                                                                        \
    };                                                                                                                 \
    template <class A>                                                                                                 \
    constexpr Name##Left<A> operator op(const A& a, Name site)                                                         \
    {                                                                                                                  \
        return {a, site.id};                                                                                           \
    }                                                                                                                  \
    template <class A, class B>                                                                                        \
    constexpr bool operator op(Name##Left<A> left, const B& b)                                                         \
    {                                                                                                                  \
        return pick(left.id, left.value op b, left.value other b);                                                     \
    }
GSC_MUTANT_COMPARISON(Lt, <, <=)
GSC_MUTANT_COMPARISON(Le, <=, <)
GSC_MUTANT_COMPARISON(Gt, >, >=)
GSC_MUTANT_COMPARISON(Ge, >=, >)
GSC_MUTANT_COMPARISON(Eq, ==, !=)
GSC_MUTANT_COMPARISON(Ne, !=, ==)
#undef GSC_MUTANT_COMPARISON

// "a * b": "a * Times{7} * b"
struct Times {
    int id;
};
template <class A>
struct TimesLeft {
    const A& value;
    int id;
};
template <class A>
constexpr TimesLeft<A> operator*(const A& a, Times site)
{
    return {a, site.id};
}
template <class A, class B>
constexpr auto operator*(TimesLeft<A> left, const B& b)
{
    using Product = std::remove_cvref_t<decltype(left.value * b)>;
    if constexpr (requires {
                      {
                          left.value / b
                          } -> std::convertible_to<Product>;
                  }) {
        if (!std::is_constant_evaluated() && isOn(left.id))
            return static_cast<Product>(left.value / b);
    } else if (!std::is_constant_evaluated()) {
        cannotBe(left.id);
    }
    return static_cast<Product>(left.value * b);
}

// "a += b": "a += Plus{7} = b"
struct Plus {
    int id;
    template <class T>
    constexpr auto operator=(const T& b) const
    {
        if constexpr (std::same_as<T, bool>)
            return operator=(int(b));
        else
            return signedAs(b);
    }
    template <class T>
    constexpr T signedAs(const T& b) const
    {
        if constexpr (requires {
                          {
                              -b
                              } -> std::convertible_to<T>;
                      }) {
            if (!std::is_constant_evaluated() && isOn(id))
                return static_cast<T>(-b);
        } else if (!std::is_constant_evaluated()) {
            cannotBe(id);
        }
        return b;
    }
};

// "!a": "Not{7} * a"
struct Not {
    int id;
    template <class T>
    constexpr bool operator*(const T& a) const
    {
        return pick(id, !static_cast<bool>(a), static_cast<bool>(a));
    }
};

// "a && b": "both(7, [&] { return a; }, [&] { return b; })"
template <class A, class B>
constexpr bool both(int id, A&& a, B&& b)
{
    const bool first = a();
    if (!std::is_constant_evaluated() && active == id)
        return first || b();
    const bool second = first && b();
    return pick<bool>(id, second, second, !second);
}
template <class A, class B>
constexpr bool either(int id, A&& a, B&& b)
{
    const bool first = a();
    if (!std::is_constant_evaluated() && active == id)
        return first && b();
    const bool second = first || b();
    return pick<bool>(id, second, second, second);
}

// "std::min(": "Extreme{7, true}("
struct Extreme {
    int id;
    bool least;
    template <class T>
    constexpr T operator()(const T& a, const T& b) const
    {
        const T& low = b < a ? b : a;
        const T& high = a < b ? b : a;
        return pick<T>(id, least ? low : high, least ? high : low, a < b || b < a);
    }
    template <class T>
    constexpr T operator()(std::initializer_list<T> list) const
    {
        T low = *list.begin();
        T high = low;
        for (const T& value : list) {
            low = value < low ? value : low;
            high = high < value ? value : high;
        }
        return pick<T>(id, least ? low : high, least ? high : low, low < high);
    }
};
} // namespace gsc_mutant

// "hn::Ge(a, b)" and "f(a, b)" with other function or other order
#define GSC_MUTANT_VECTOR(id, as_written, changed)                                                                     \
    [&](auto a_, auto b_) HWY_ATTR { return gsc_mutant::isOn(id) ? changed(a_, b_) : as_written(a_, b_); }
#define GSC_MUTANT_SWAP(id, function)                                                                                  \
    [&](auto&& a_, auto&& b_) -> decltype(auto) {                                                                      \
        if constexpr (requires { function(b_, a_); }) {                                                                \
            if (gsc_mutant::isOn(id))                                                                                  \
                return function(b_, a_);                                                                               \
        } else {                                                                                                       \
            gsc_mutant::cannotBe(id);                                                                                  \
        }                                                                                                              \
        return function(a_, b_);                                                                                       \
    }
