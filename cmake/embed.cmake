# cmake -DFROM=page.html -DTO=page.cpp -DNAME=page -P embed.cmake: the text of a file as a C++ string.
file(READ "${FROM}" text)
file(WRITE "${TO}" "#include <string_view>\nnamespace polymorph {\nextern const std::string_view ${NAME};\nconst std::string_view ${NAME} = R\"~text~(${text})~text~\";\n}  // namespace polymorph\n")
