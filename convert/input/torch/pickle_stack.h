// SPDX-License-Identifier: Apache-2.0
// The stack, the marks and the memo of the pickle machine, with limits on their size, and the opcodes that push values
// written in the pickle itself.
#pragma once

#include "convert/input/torch/pickle_input.h"
#include "convert/input/torch/pickle_machine.h"

#include <algorithm>
#include <bit>
#include <charconv>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <string>
#include <utility>
#include <vector>

namespace gsc {

// Limit of values in a pickle, small enough to be harmless; the trainers' checkpoints have about 150, and 60 memo
// slots.
constexpr size_t kMaxPickleValues = 1u << 18;
constexpr size_t kMaxPickleMemo = 1u << 18;
constexpr size_t kMaxPickleLine = 1u << 16; // most characters of a value that protocol 0 writes as a line of text
// A pickle can copy a value of the memo with two bytes, however large the value is. So all copies together may take
// this many bytes for each byte of the pickle read so far, and kPickleCopiedAlways besides. PyTorch's need less than
// one.
constexpr size_t kPickleCopiedForByte = 4;
constexpr size_t kPickleCopiedAlways = 1u << 20;

class PickleStack : protected PickleInput {
public:
    using PickleInput::PickleInput;
    using PickleInput::position;

protected:
    static constexpr uint32_t kNoValue = ~0u;

    uint32_t add(PickleValue value)
    {
        if (m_graph.values.size() >= kMaxPickleValues)
            unsupported(formatString("more than %zu values", kMaxPickleValues));
        m_graph.values.push_back(std::move(value));
        return uint32_t(m_graph.values.size() - 1);
    }

    void push(PickleValue value) { m_stack.push_back(add(std::move(value))); }
    void pushInt(int64_t integer) { push({PickleKind::Int, integer, 0, {}, {}}); }
    void pushEmpty(PickleKind kind) { push({kind, 0, 0, {}, {}}); }

    uint32_t top()
    {
        // values below the newest mark cannot be popped: they belong to the code before that mark
        if (m_stack.size() <= (m_marks.empty() ? 0 : m_marks.back()))
            invalid("stack underflow");
        return m_stack.back();
    }

    uint32_t pop()
    {
        const uint32_t value = top();
        m_stack.pop_back();
        return value;
    }

    std::vector<uint32_t> popToMark()
    {
        if (m_marks.empty())
            invalid("no mark on the stack");
        const size_t first = m_marks.back();
        m_marks.pop_back();
        std::vector<uint32_t> items(m_stack.begin() + std::ptrdiff_t(first), m_stack.end());
        m_stack.resize(first);
        return items;
    }

    void pushTuple(size_t count)
    {
        PickleValue tuple{PickleKind::Tuple, 0, 0, {}, std::vector<uint32_t>(count)};
        for (size_t i = count; i-- > 0;)
            tuple.items[i] = pop();
        push(std::move(tuple));
    }

    // Opcode POP: removes the topmost value, or the newest mark if no value lies above it.
    void drop()
    {
        if (!m_marks.empty() && m_stack.size() == m_marks.back())
            m_marks.pop_back();
        else
            (void)pop();
    }

    void repeatTop()
    {
        m_stack.push_back(top());
        if (m_stack.size() > kMaxPickleValues)
            invalid(formatString("more than %zu values on the stack", kMaxPickleValues));
    }

    void pushOther(std::string what) { push({PickleKind::Other, 0, 0, std::move(what), {}}); }

    void mark()
    {
        m_marks.push_back(m_stack.size());
        if (m_marks.size() > kMaxPickleValues)
            invalid(formatString("more than %zu marks", kMaxPickleValues));
    }

    // Counts `bytes` that are about to be copied; throws if all copies together exceed the limit.
    void charge(size_t bytes)
    {
        const size_t most = kPickleCopiedAlways + kPickleCopiedForByte * position();
        if (bytes > most - std::min(m_copied, most))
            invalid(formatString("values that are used again take more than %zu bytes", most));
        m_copied += bytes;
    }

    std::string copyOf(const std::string& text)
    {
        charge(text.size());
        return text;
    }

    // note: the reference must not be used after a push(), which may move all values
    PickleValue& expect(uint32_t value, PickleKind kind, const char* what)
    {
        PickleValue& found = m_graph.values[value];
        if (found.kind != kind)
            invalid(formatString("%s expected", what));
        return found;
    }

    void put(uint64_t slot)
    {
        if (slot >= kMaxPickleMemo)
            invalid(formatString("memo slot %llu", static_cast<unsigned long long>(slot)));
        if (slot >= m_memo.size())
            m_memo.resize(slot + 1, kNoValue);
        m_memo_count += m_memo[slot] == kNoValue;
        m_memo[slot] = top();
    }

    void memoize() { put(m_memo_count); } // stores the top value in the next free slot of the memo

    void get(uint64_t slot)
    {
        if (slot >= m_memo.size() || m_memo[slot] == kNoValue)
            invalid(formatString("memo slot %llu is empty", static_cast<unsigned long long>(slot)));
        m_stack.push_back(m_memo[slot]);
        if (m_stack.size() > kMaxPickleValues)
            invalid(formatString("more than %zu values on the stack", kMaxPickleValues));
    }

    // Pushes an integer of `count` bytes, little-endian, two's complement.
    void pushLong(uint64_t count)
    {
        if (count > sizeof(uint64_t))
            return pushOther(kWideInteger + takeText(size_t(count)));
        uint64_t value = takeUnsigned(size_t(count));
        if (count > 0 && count < 8 && (value >> (8 * count - 1)) != 0) // extends the sign
            value |= ~uint64_t(0) << (8 * count);
        pushInt(int64_t(value));
    }

    // Pushes an integer of protocol 0: decimal digits, and an L at the end for a long.
    void pushDecimal()
    {
        std::string line = takeLine(kMaxPickleLine);
        if (line == "00" || line == "01")
            return push({PickleKind::Bool, line == "01", 0, {}, {}});
        if (line.ends_with('L'))
            line.pop_back();
        int64_t value = 0;
        const auto [end, error] = std::from_chars(line.data(), line.data() + line.size(), value);
        if (end != line.data() + line.size() || (error != std::errc() && error != std::errc::result_out_of_range))
            invalid("integer that is none");
        if (error != std::errc())
            return pushOther(kWideInteger + line);
        pushInt(value);
    }

    void pushFloatLine()
    {
        const std::string line = takeLine(kMaxPickleLine);
        char* end = nullptr;
        const double value = std::strtod(line.c_str(), &end);
        if (line.empty() || *end != '\0')
            invalid("number that is none");
        push({PickleKind::Float, 0, value, {}, {}});
    }

    // Pushes a text of protocol 0, quoted or not. Escapes stay as they are, because none of our names has any.
    void pushTextLine(bool quoted)
    {
        std::string line = takeLine(kMaxPickleLine);
        if (quoted) {
            if (line.size() < 2 || line.front() != line.back() || (line[0] != '\'' && line[0] != '"'))
                invalid("string without its quotes");
            line = line.substr(1, line.size() - 2);
        }
        push({PickleKind::String, 0, 0, std::move(line), {}});
    }

    void pushText(size_t size_bytes)
    {
        push({PickleKind::String, 0, 0, takeText(size_t(takeUnsigned(size_bytes))), {}});
    }

    void pushBytes(size_t size_bytes)
    {
        (void)take(size_t(takeUnsigned(size_bytes)));
        pushOther("bytes");
    }

    uint64_t takeSlot()
    {
        const std::string line = takeLine(kMaxPickleLine);
        uint64_t slot = 0;
        const auto [end, error] = std::from_chars(line.data(), line.data() + line.size(), slot);
        if (error != std::errc() || end != line.data() + line.size())
            invalid("memo slot that is no number");
        return slot;
    }

    void pushFloat() // stored big-endian
    {
        uint64_t bits = 0;
        for (const std::byte byte : take(8))
            bits = bits << 8 | uint64_t(byte);
        push({PickleKind::Float, 0, std::bit_cast<double>(bits), {}, {}});
    }

    PickleGraph m_graph;
    std::vector<uint32_t> m_stack;
    std::vector<size_t> m_marks; // height of m_stack at each mark
    std::vector<uint32_t> m_memo;
    size_t m_memo_count = 0; // slots of the memo that are used
    size_t m_copied = 0;     // bytes copied so far, see charge()
};

} // namespace gsc
