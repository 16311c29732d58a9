"""Names that the engineering tools take, and those that they keep for themselves. IEC names ignore case.

The lists come from public grammars of the languages, not from the vendors: a word too many here costs a rename, a word
that is missing costs a compiler's message.
"""

from __future__ import annotations

from typing import Final

_BLOCKS: Final = """
    action array at case configuration constant do else elsif end_action end_case end_configuration end_for end_function
    end_function_block end_if end_program end_repeat end_resource end_step end_struct end_transition end_type end_var
    end_while exit false for from function function_block if initial_step of on program read_only read_write repeat
    resource retain non_retain return single step struct task then to transition true type until var var_access
    var_config var_external var_global var_in_out var_input var_output var_temp while with f_edge r_edge by interval
    priority not and or xor mod en eno
"""
_TYPES: Final = """
    any any_bit any_date any_derived any_elementary any_int any_magnitude any_num any_real any_string bool byte date
    date_and_time dint dt dword int lint lreal lword real sint string time time_of_day tod udint uint ulint usint word
    wstring
"""
_FUNCTIONS: Final = """
    abs acos add asin atan concat cos ctd ctu ctud delete div eq exp expt f_trig find ge gt insert le left len limit ln
    log lt max mid min move mul mux ne r_trig replace right rol ror rs sel shl shr sin sqrt sr sub tan tof ton tp trunc
"""
_EDITION_3: Final = """
    abstract class continue end_class end_interface end_method end_namespace end_property extends final implements
    interface internal method namespace null override private property protected public ref ref_to super this using
    ltime ldate ldt ltod char wchar overlap
"""
_CODESYS: Final = """
    adr bitadr indexof ini sizeof pointer reference union end_union var_stat var_inst persistent params any_type bit
    cal calc calcn jmp jmpc jmpcn ld ldn st stn s r andn orn xorn retc retcn ret ceil floor __new __delete __isvalidref
    __queryinterface __querypointer __try __catch __finally __endtry and_then or_else xsizeof
"""
_SIEMENS: Final = """
    begin data_block end_data_block organization_block end_organization_block title version goto label end_label
    const end_const variant db_any any block_db block_fb block_fc block_sdb block_sfb block_sfc counter timer
    s5time date_and_ltime dtl void region end_region hw_io pointer char wchar
"""
_LOGIX: Final = """
    abs acs add and asn atn bit cmp cop cos cpt dint div equ fal fifo flip int jsr lim ln log lint lreal mod mov mul
    neg not or real ret sbr sint sin sqr sub tan timer counter control string tnd trn uid uie ulint udint uint usint xor
"""

_C: Final = """
    auto break case char const continue default do double else enum extern float for goto if inline int long register
    restrict return short signed sizeof static struct switch typedef union unsigned void volatile while bool true false
    alignas alignof asm class delete export new operator private protected public template this throw try virtual
    and bitand bitor catch compl explicit friend mutable namespace nullptr not or typename using xor
"""
_C_MACROS: Final = """
    dbl_decimal_dig dbl_dig dbl_epsilon dbl_has_subnorm dbl_mant_dig dbl_max dbl_max_10_exp dbl_max_exp dbl_min
    dbl_min_10_exp dbl_min_exp dbl_true_min decimal_dig flt_decimal_dig flt_dig flt_epsilon flt_eval_method
    flt_has_subnorm flt_mant_dig flt_max flt_max_10_exp flt_max_exp flt_min flt_min_10_exp flt_min_exp flt_radix
    flt_rounds flt_true_min fp_ilogb0 fp_ilogbnan fp_infinite fp_nan fp_normal fp_subnormal fp_zero huge_val
    huge_valf huge_vall infinity int16_max int16_min int32_max int32_min int64_max int64_min int8_max int8_min
    int_fast16_max int_fast16_min int_fast32_max int_fast32_min int_fast64_max int_fast64_min int_fast8_max
    int_fast8_min int_least16_max int_least16_min int_least32_max int_least32_min int_least64_max int_least64_min
    int_least8_max int_least8_min intmax_max intmax_min intptr_max intptr_min ldbl_decimal_dig ldbl_dig ldbl_epsilon
    ldbl_has_subnorm ldbl_mant_dig ldbl_max ldbl_max_10_exp ldbl_max_exp ldbl_min ldbl_min_10_exp ldbl_min_exp
    ldbl_true_min linux m_1_pi m_2_pi m_2_sqrtpi m_e m_ln10 m_ln2 m_log10e m_log2e m_pi m_pi_2 m_pi_4 m_sqrt1_2
    m_sqrt2 math_errexcept math_errhandling math_errno nan null ptrdiff_max ptrdiff_min sig_atomic_max
    sig_atomic_min size_max uint16_max uint32_max uint64_max uint8_max uint_fast16_max uint_fast32_max
    uint_fast64_max uint_fast8_max uint_least16_max uint_least32_max uint_least64_max uint_least8_max uintmax_max
    uintptr_max unix wchar_max wchar_min wint_max wint_min
"""


def _words(*lists: str) -> frozenset[str]:
    return frozenset(word for words in lists for word in words.split())


IEC: Final = _words(_BLOCKS, _TYPES, _FUNCTIONS)
"""Of edition 2, with the standard's functions, whose names no variable should hide."""
CODESYS: Final = IEC | _words(_EDITION_3, _CODESYS)
"""Of CODESYS 3 and of TwinCAT 3, which stems from it."""
SIEMENS: Final = IEC | _words(_EDITION_3, _SIEMENS)
LOGIX: Final = _words(_LOGIX, _BLOCKS, _TYPES)
C: Final = _words(_C, _C_MACROS)
"""Of C, what the headers that ours includes define as macros, and words of C++ for a header that both read."""
