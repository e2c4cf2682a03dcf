# add_suites.cmake: gives CTest one test for each suite of a GoogleTest program, when CTest starts.
#
# A process for each test of each suite costs as much as the tests themselves: half of them take less
# than the start of a process, which is slow under sanitizers. The tests of a suite share one, except
# where the pattern `apart` says otherwise.
#
# Included by CTest with: program, folder, filter, apart (a regular expression), properties.
if(NOT EXISTS ${program})
  add_test(${folder}/NOT_BUILT ${program})  # fails and names the program
  return()
endif()
execute_process(COMMAND ${program} --gtest_list_tests --gtest_filter=${filter}
  OUTPUT_VARIABLE listing RESULT_VARIABLE result ERROR_VARIABLE errors)
if(result)
  message(FATAL_ERROR "${program} does not list its tests:\n${errors}")
endif()
string(REGEX REPLACE " *#[^\n]*" "" listing "${listing}")  # what parameters are
string(REPLACE "\n" ";" lines "${listing}")
foreach(line IN LISTS lines)
  if(line MATCHES "^([^ ]+)[.]$")
    set(suite ${CMAKE_MATCH_1})
    set(is_apart NO)
    if(apart AND suite MATCHES "^(${apart})$")
      set(is_apart YES)
    else()
      # The filter may leave out tests of the suite: what follows its minus holds here too.
      set(without)
      if(filter MATCHES "-.*")
        set(without ${CMAKE_MATCH_0})
      endif()
      add_test("${folder}/${suite}" ${program} "--gtest_filter=${suite}.*${without}")
      set_tests_properties("${folder}/${suite}" PROPERTIES ${properties})
    endif()
  elseif(is_apart AND line MATCHES "^  ([^ ]+)$")
    set(test "${suite}.${CMAKE_MATCH_1}")
    add_test("${folder}/${test}" ${program} "--gtest_filter=${test}")
    set_tests_properties("${folder}/${test}" PROPERTIES ${properties})
  endif()
endforeach()
